"""A flex body of MuJoCo under an instrument, if installed, ends where elements of its law do, with its own force."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.touched_block import BALL, block_of, mirrored, reflection, rmse_of_peak, touch_at

from palpate.benchmark.model import LeftOut
from palpate.effects.instrument import Instrument
from palpate.effects.linear_elements import LinearElements
from palpate.errors import NotConverged
from palpate.models.touch import fem, mujoco_flex

pytest.importorskip("mujoco")
SETTLED = {"level": 0, "penalty": 1.0, "steps": 100, "iterations": 150}
WAY = (0.2, 0.1, -1.0)
DEPTH_M = 5e-3
INSTRUMENTS = [
    (BALL, 0.03, 0.02),
    (Instrument("capsule", 0.02, length_m=0.03), 0.05, 0.03),
    (Instrument("punch", 0.02), 0.05, 0.1),
]
"""Instruments, and how far the force and the surface may be from those of elements, which touch at other points."""


def under(case, instrument, law="corotational"):
    material = replace(case.body.material, law=law)
    return replace(case, instrument=instrument, body=replace(case.body, material=material))


def pressed(case, depth_m=DEPTH_M, way=WAY):
    return replace(touch_at(case, (0.5, 0.5), depth_m, way), instrument=case.instrument)


@pytest.fixture(scope="module")
def elements(block):
    """Elements of MuJoCo's law."""
    body = under(block, BALL, mujoco_flex.LAW).body
    return LinearElements(body.fine, body.tissue(0))


@pytest.fixture(scope="module")
def settled(block):
    return mujoco_flex.online(block, **SETTLED)


def apart(case, setting):
    """Return how far force and surface are from those of elements of MuJoCo's law on the same mesh."""
    found = mujoco_flex.online(case, **setting).respond(pressed(case))
    elements = fem.online(under(case, case.instrument, mujoco_flex.LAW), level=setting["level"], order=1)
    right = elements.respond(pressed(case))
    return abs(found.force_n / right.force_n - 1.0), rmse_of_peak(found.displacement, right.displacement)


@pytest.mark.parametrize(("instrument", "force", "surface"), INSTRUMENTS)
def test_it_ends_near_elements_of_its_law(block, instrument, force, surface):
    found = apart(under(block, instrument), SETTLED)
    assert found[0] < force and found[1] < surface


def test_the_finer_the_mesh_the_nearer_they_are():
    case = block_of([6, 6, 3], 1)
    assert apart(case, SETTLED | {"level": 1})[1] < 0.5 * apart(case, SETTLED)[1]


def test_elements_of_its_law_bear_its_force(block, settled, elements):
    """Nodes that do not touch are in equilibrium, and what is held feels the force that MuJoCo reports."""
    found = settled.respond(pressed(block))
    flex = settled._flex
    pulled = elements.force(flex.rest + flex.displaced())
    touching = np.unique(elements.tetrahedra[[contact.elem[1] for contact in flex.data.contact]])
    free = np.setdiff1d(np.flatnonzero(flex.bodies), touching)
    assert np.abs(pulled[free]).max() < 1e-4 * found.force_n
    felt = pulled[block.body.anchors[0]].sum(axis=0) @ pressed(block).direction
    assert felt == pytest.approx(found.force_n, rel=1e-3)
    assert found.reaction_n == pytest.approx(felt, rel=1e-3)
    assert np.isnan(found.area_m2)


def test_the_contact_has_the_stiffness_that_is_asked_for(block, settled, elements):
    settled.respond(pressed(block))
    flex, own = settled._flex, np.zeros(6)
    asked = SETTLED["penalty"] * np.median(elements.resistance())
    for number, contact in enumerate(flex.data.contact):
        flex.engine.mj_contactForce(flex.model, flex.data, number, own)
        assert own[0] == pytest.approx(-asked * contact.dist, rel=1e-2)


def test_the_force_is_the_slope_of_the_energy(block, settled, elements):
    """That of the body, by palpate's elements, and of the springs of contact."""
    asked = SETTLED["penalty"] * np.median(elements.resistance())
    step_m, energies = 2e-4, []
    force = settled.respond(pressed(block)).force_n
    for depth_m in (DEPTH_M - step_m, DEPTH_M + step_m):
        settled.respond(pressed(block, depth_m))
        flex = settled._flex
        overlaps = np.array([min(contact.dist, 0.0) for contact in flex.data.contact])
        stored = elements.energy(flex.rest + flex.displaced())
        energies.append(stored + 0.5 * asked * float(overlaps @ overlaps))
    assert (energies[1] - energies[0]) / (2.0 * step_m) == pytest.approx(force, rel=5e-3)


def test_harder_contact_lets_less_in(block):
    found = [
        mujoco_flex.online(block, **SETTLED | {"penalty": penalty}).respond(pressed(block))
        for penalty in (0.01, 0.1, 1.0, 10.0)
    ]
    forces = np.diff([each.force_n for each in found])
    assert (forces > 0.0).all() and forces[2] < 0.5 * forces[1]


def test_a_mirrored_touch_has_the_mirrored_answer(block, settled):
    found, other = (settled.respond(each) for each in (pressed(block), mirrored(pressed(block))))
    assert other.force_n == pytest.approx(found.force_n, rel=5e-3)
    assert rmse_of_peak(other.displacement[reflection(block)] * [-1.0, 1.0, 1.0], found.displacement) < 5e-3


def test_answers_do_not_depend_on_those_before(block, settled):
    found = settled.respond(pressed(block))
    settled.respond(pressed(block, 2e-3))
    again = settled.respond(pressed(block))
    assert np.array_equal(found.displacement, again.displacement) and found.force_n == again.force_n


@pytest.mark.parametrize(("depth_m", "way"), [(0.0, WAY), (5e-4, (0.0, 0.0, 1.0))])
def test_what_does_not_touch_moves_nothing(block, settled, depth_m, way):
    """At no depth; and of an instrument that leaves."""
    first = pressed(block)
    first.pose(block.body)
    found = settled.respond(replace(first, depth_m=depth_m, direction=np.array(way)))
    assert found.force_n == pytest.approx(0.0, abs=1e-10) and found.reaction_n == pytest.approx(0.0, abs=1e-10)
    assert np.abs(found.displacement).max() < 1e-9


def test_what_flies_apart_is_said(block):
    solver = mujoco_flex.online(block, **SETTLED)
    solver._flex.data.qvel[0] = np.nan
    with pytest.raises(NotConverged, match="flies apart"):
        solver._flex.step()


def test_what_it_does_not_know_is_left_out(block):
    for instrument in (Instrument("punch", 0.02, edge_m=0.002), replace(BALL, sticks=True)):
        with pytest.raises(LeftOut):
            mujoco_flex.online(under(block, instrument), **SETTLED)


def test_settings_are_those_of_levels_that_the_body_has(block):
    assert {each["level"] for each in mujoco_flex.TRIED} == {1, 2} and not mujoco_flex.settings(block)
