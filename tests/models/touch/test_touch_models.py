"""Reduced and linear models of a place, against the elements that they are made of."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.touched_pad import *  # noqa: F403
from fixtures.touched_pad import DEEPEST

from palpate.benchmark.touch import TouchCase, TouchDoubted
from palpate.bodies.material import Material
from palpate.models.reduced.cubature_points import elastic, scratch_of
from palpate.models.reduced.search import touched
from palpate.models.touch import fem, linear, modes


@pytest.fixture(scope="module")
def answers(touch_case, touches):
    """Of elements, of reduced and of linear models on the same mesh, by model."""
    elements = fem.online(touch_case, **dict(touch_case.grid.fem.local[0]))
    found = {"elements": [elements.respond(touch) for touch in touches]}
    for name, model in (("modes", modes), ("linear", linear)):
        solver = model.online(touch_case, **model.settings(touch_case)[0])
        solver.prepare(touches[0])
        found[name] = [solver.respond(touch) for touch in touches]
    return found


def away(one, other):
    """RMSE over peak."""
    apart = np.linalg.norm(one.displacement - other.displacement, axis=1)
    return np.sqrt(np.mean(apart**2)) / np.linalg.norm(other.displacement, axis=1).max()


@pytest.mark.parametrize("number", [0, 1])
def test_modes_answer_as_their_elements_do(answers, number):
    found, elements = answers["modes"][number], answers["elements"][number]
    assert away(found, elements) < 0.006
    assert found.force_n == pytest.approx(elements.force_n, rel=0.04)


def test_linear_responses_are_too_stiff_where_tissue_is_pressed_deep(answers):
    found, elements = answers["linear"][0], answers["elements"][0]
    assert away(found, elements) < 0.05
    assert 1.02 < found.force_n / elements.force_n < 1.3


def test_warped_responses_are_nearer_to_the_elements(touch_case, touches, answers):
    """With discs enough that what is left is the linear law's error, not theirs."""
    found = {}
    for warped in (False, True):
        solver = linear.online(touch_case, discs=60, held=0, level=2, warped=warped)
        solver.prepare(touches[0])
        found[warped] = [solver.respond(touch) for touch in touches]
    for plain, turned, elements in zip(found[False], found[True], answers["elements"], strict=True):
        assert away(turned, elements) < 0.9 * away(plain, elements)
        assert abs(turned.force_n - elements.force_n) < 0.7 * abs(plain.force_n - elements.force_n)


def test_linear_responses_agree_with_elements_of_a_shallow_touch(touch_case, touches):
    """What is not linear vanishes with the depth; what is left is the few discs and the one direction of pressure."""
    shallow = replace(touches[0], depth_m=0.0008)
    solver = linear.online(touch_case, discs=60, held=0, level=2, warped=False)
    solver.prepare(shallow)
    elements = fem.online(touch_case, held=0, level=2).respond(shallow)
    assert solver.respond(shallow).force_n == pytest.approx(elements.force_n, rel=0.05)


def test_the_force_is_the_slope_of_the_energy(touch_case, touches):
    """In few coordinates, too: by central differences over the depth of all that is stored."""
    solver = modes.online(touch_case, **modes.settings(touch_case)[0])
    solver.prepare(touches[0])
    place = solver._places[touches[0].node]
    step = 1e-5
    stored = []
    for depth in (0.005 - step, 0.005 + step):
        touch = replace(touches[0], depth_m=depth, poses={})
        q = place.expected(touch)
        place.answer(touch, q)
        pose = touch.pose(touch_case.body).moved(depth * touch.direction)
        count, body = len(place.points[2]), place.model.body
        scratch = np.empty((count, 3)), np.empty(count), np.empty((count, 3)), np.empty(count)
        where = *place.points, pose.tip, pose.axes, pose.instrument.shape
        energies = elastic(q, body, scratch_of(body))[0], touched(q, (place.model.base, *where, *scratch))[0]
        stored.append(sum(energies))
    slope = (stored[1] - stored[0]) / (2.0 * step)
    # the instrument's force on the body along its way is what the hand feels
    assert solver.respond(touches[0]).force_n == pytest.approx(slope, rel=1e-3)


def test_beyond_what_was_prepared_modes_doubt(touch_case, touches):
    solver = modes.online(touch_case, **modes.settings(touch_case)[0])
    solver.prepare(touches[0])
    with pytest.raises(TouchDoubted, match="deeper"):
        solver.respond(replace(touches[0], depth_m=1.01 * DEEPEST, poses={}))
    with pytest.raises(TouchDoubted, match="degrees"):
        way = np.array([np.sin(0.9), 0.0, -np.cos(0.9)])
        solver.respond(replace(touches[0], direction=way, poses={}))


@pytest.mark.slow
def test_modes_take_other_laws(touch_case, touches):
    soft = Material(3000.0, 0.3, 1000.0, "stable_neo_hookean")
    case = TouchCase(replace(touch_case.body, material=soft), touch_case.instrument, DEEPEST, 1, touch_case.grid)
    touch = replace(touches[0], poses={})
    solver = modes.online(case, **modes.settings(case)[0])
    solver.prepare(touch)
    elements = fem.online(case, **dict(case.grid.fem.local[0])).respond(touch)
    assert away(solver.respond(touch), elements) < 0.006
    assert solver.respond(touch).force_n == pytest.approx(elements.force_n, rel=0.02)


def test_cells_without_a_rotation_are_doubted_or_left(touch_case, touches):
    """From turned-out cells a search ends where it does from good ones, or doubts; from no numbers it doubts."""
    solver = modes.online(touch_case, **modes.settings(touch_case)[0])
    solver.prepare(touches[0])
    place, force = solver.reduced(touches[0].node), solver.respond(touches[0]).force_n
    for scale in (-50.0, 50.0, np.nan):
        q = np.full(place.count, scale * 1e-1)
        try:
            found = place.answer(touches[0], q)
        except TouchDoubted:
            continue
        assert np.isfinite(scale) and found.force_n == pytest.approx(force, rel=1e-2)
    with pytest.raises(TouchDoubted):
        place.answer(touches[0], np.full(place.count, np.nan))


def test_beyond_what_was_prepared_linear_responses_doubt(touch_case, touches):
    solver = linear.online(touch_case, **linear.settings(touch_case)[0])
    solver.prepare(touches[0])
    with pytest.raises(TouchDoubted):
        solver.respond(replace(touches[0], depth_m=1.01 * DEEPEST, poses={}))
