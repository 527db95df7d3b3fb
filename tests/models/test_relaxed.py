"""Methods that games relax bodies with: given the time, they end where finite elements do."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.games import LONG, WITHIN

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Load, Press, Refused
from palpate.errors import InputError, NotConverged
from palpate.models.kinds import FEM


@pytest.fixture(scope="module")
def pressed(slab_case):
    """The slab under a disc, and a load that moves it by a tenth of its size."""
    case, test, _ = slab_case
    case = replace(case, radius_m=0.03)
    return case, Load.at(test.contact[0], 1.5 * test.force[0])


def ask(pressed, method, **changed):
    case, load = pressed
    return LONG[method].having(**changed).prepare(case).respond(load)


@pytest.fixture(scope="module")
def equilibrium(pressed):
    case, load = pressed
    return FEM(order=1, level=0, tolerance=1e-10).prepare(case).respond(load)


@pytest.mark.parametrize("method", LONG)
def test_each_ends_at_the_equilibrium(pressed, equilibrium, method):
    assert errors(ask(pressed, method), equilibrium).rmse_of_peak < WITHIN[method]


@pytest.mark.parametrize(
    "method, plain, steps, few, many",
    [
        ("vertex_block_descent", {"radius": 0}, "sweeps", 100, 8000),
        ("projective_dynamics", {"memory": 0}, "iterations", 8, 3000),
    ],
)
def test_what_accelerates_helps_on_the_way_and_does_not_change_the_end(
    pressed, equilibrium, method, plain, steps, few, many
):
    """It is Chebyshev's weights, and a memory."""
    with_it, without = (ask(pressed, method, **{steps: few}, **change) for change in ({}, plain))
    assert errors(with_it, equilibrium).rmse_of_peak < 0.9 * errors(without, equilibrium).rmse_of_peak
    fast, slow = ask(pressed, method), ask(pressed, method, **{steps: many}, **plain)
    assert errors(fast, slow).rmse_of_peak < 1e-6


FEW = {
    "xpbd": {"steps": 10, "step": 1.5},
    "vertex_block_descent": {"sweeps": 10, "radius": 0.99},
    "projective_dynamics": {"iterations": 3},
}


@pytest.mark.parametrize("method", LONG)
def test_a_frame_before_helps_as_far_as_the_method_has_come_by_itself(pressed, equilibrium, method):
    """Nearer than from rest with as many steps, and not nearer than the frames' own steps let it: they are its own."""
    case, load = pressed
    fewest = {"xpbd": "steps", "vertex_block_descent": "sweeps", "projective_dynamics": "iterations"}[method]
    frame = LONG[method].having(**FEW[method], start="frame")
    following, lagging, none = (each.prepare(case) for each in (frame, frame.having(**{fewest: 1}), frame))
    for solver in (following, lagging):
        solver.precede(load)
    found, behind = (errors(solver.respond(load), equilibrium).rmse_of_peak for solver in (following, lagging))
    cold = ask(pressed, method, **FEW[method])
    assert found < 0.5 * errors(cold, equilibrium).rmse_of_peak and found < behind
    assert np.array_equal(none.respond(load), cold)


def test_a_radius_that_is_too_large_does_no_harm(pressed, equilibrium):
    """Without a start anew the weights blow up."""
    found = [errors(ask(pressed, "vertex_block_descent", sweeps=n, radius=0.99999), equilibrium) for n in (150, 600)]
    assert found[1].rmse_of_peak < 0.5 * found[0].rmse_of_peak and found[1].rmse_of_peak < 0.02


@pytest.mark.parametrize("method", LONG)
def test_what_they_cannot_do_they_refuse(pressed, method):
    case, load = pressed
    solver = LONG[method].prepare(case)
    with pytest.raises(InputError, match="not a free surface node"):
        solver.respond(Load.at(case.body.anchors[0][0], np.ones(3)))
    with pytest.raises(Refused):
        solver.respond(Load((Press(load.presses[0].node, moved=np.ones(3)),)))
    other = replace(case.body.material, law="neo_hookean")
    with pytest.raises(NotConverged, match="corotational law"):
        LONG[method].prepare(replace(case, body=replace(case.body, material=other)))


@pytest.mark.parametrize("method", LONG)
def test_two_presses_are_more_than_one(pressed, method):
    """Under small forces answers add up, those to both at once as well."""
    case, load = pressed
    node, force = load.single()
    other = int(np.setdiff1d(case.database.contact, [node])[0])
    loads = [Load((Press(node, 1e-4 * force),)), Load((Press(other, 1e-4 * force),))]
    solver = LONG[method].prepare(case)
    one, two, both = (solver.respond(each) for each in (*loads, Load(loads[0].presses + loads[1].presses)))
    assert np.abs(one + two - both).max() < 0.05 * np.abs(both).max()


LONGER = {
    "xpbd": {"steps": 6000, "step": 0.125},
    "vertex_block_descent": {"sweeps": 2000},
    "projective_dynamics": {"iterations": 300},
}
"""What is changed of LONG: a soft bed takes longer to settle on."""


@pytest.fixture(scope="module")
def distance(bedded):
    """How far from the elements' equilibrium a method ends, under a press of 7 mm on the slab of 0.2 m."""
    load = Load.at(int(bedded.response.contacts[0]), np.array([0.5, 0.0, -1.5]))
    equilibrium = FEM(order=1, level=0, tolerance=1e-10).prepare(bedded).respond(load)

    def measure(method, **changed):
        found = LONG[method].having(**LONGER[method] | changed).prepare(bedded).respond(load)
        return errors(found, equilibrium).rmse_of_peak

    return measure


@pytest.mark.parametrize("method", LONGER)
def test_methods_of_games_end_at_the_equilibrium_on_a_bed(distance, method):
    assert distance(method) < WITHIN[method]


def test_steps_of_xpbd_end_nearer_with_their_square(distance):
    """Springs that differ from the elements' would leave an error that does not depend on the step."""
    assert distance("xpbd") < 0.3 * distance("xpbd", step=0.25, steps=3000)
