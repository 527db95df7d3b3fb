"""Loads beyond one force at a prepared contact: other places, several presses, discs that are pushed to a depth."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.load import Answer, Load, Press, Refused
from palpate.bodies.contacts import surface_contacts
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import patch_at, spread
from palpate.errors import InputError, NotConverged
from palpate.models.depths import find_forces
from palpate.models.fem_statics import ContactShares, Simulation, to_surface
from palpate.models.kinds import FEM, ContactModes, LinearFEM, WarpedCompliance
from palpate.models.model_registry import MODELS
from palpate.solvers.compliance import compute_compliance
from palpate.solvers.equilibrium import Equilibrium

RADIUS_M = 0.03
TOLERANCE = 1e-9


@pytest.fixture(scope="module")
def case(slab_case):
    """The slab's case under discs, with the linear responses to these of linear elements."""
    return replace(slab_case[0], radius_m=RADIUS_M, response=compute_compliance(slab_case[0].body, RADIUS_M), used={})


@pytest.fixture(scope="module")
def places(case, slab_case):
    """Two contacts that are apart, a fine surface node that is none, and a force that moves the slab by a tenth."""
    contacts, body = np.unique(slab_case[1].contact), case.body
    away = np.linalg.norm(body.fine.nodes[contacts] - body.fine.nodes[contacts[0]], axis=1)
    nodes = body.fine.surface[body.fine.surface >= len(body.coarse.nodes)]
    node = nodes[np.argmax(body.fine.nodes[nodes, 0])]
    return int(contacts[0]), int(contacts[away.argmax()]), int(node), 1.5 * slab_case[1].force[0]


def solved(body, level, order, presses):
    """Return the displacements of all nodes of a level under forces at fine nodes, by another way."""
    whole = finer(body) if order == 2 and level == 1 else body
    problem = Equilibrium(whole, level, order)
    load = sum(spread(whole.levels[level], patch_at(body, node, RADIUS_M), force, order) for node, force in presses)
    return problem, problem.solve(load, 1e-10).x - problem.mesh.nodes


@pytest.mark.parametrize(("order", "level"), [(1, 0), (1, 1), (2, 0), (2, 1)])
def test_elements_answer_anywhere_on_the_fine_surface_and_several_presses(case, places, order, level):
    one, other, node, force = places
    for presses in ([(node, force)], [(one, 0.7 * force), (other, -0.4 * force), (node, 0.2 * force)]):
        found = Simulation(case, level, 1e-10, order=order).displacement(Load(tuple(Press(*p) for p in presses)))
        expected = solved(case.body, level, order, presses)[1]
        assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()


@pytest.mark.parametrize(("order", "level"), [(1, 0), (1, 1), (2, 0)])
def test_a_disc_that_is_pushed_as_far_as_a_force_pushes_it_bears_that_force(case, places, order, level):
    one, _, node, force = places
    given = Load((Press(one, 0.8 * force), Press(node, 0.3 * force)))
    simulation = Simulation(case, level, 1e-9, order=order)
    expected = simulation.displacement(given)
    ways = simulation.means(given, expected)
    asked = {
        "all to a depth": Load((Press(one, moved=ways[0]), Press(node, moved=ways[1]))),
        "one of each": Load((Press(one, given.presses[0].force), Press(node, moved=ways[1]))),
    }
    for load in asked.values():
        found, forces = simulation.answer(load)
        assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()
        assert np.abs(forces - [0.8 * force, 0.3 * force]).max() < 1e-6 * np.abs(force).max()


@pytest.mark.parametrize("order", [1, 2])
def test_a_disc_that_reaches_over_held_nodes_is_pushed_by_those_that_are_free(case, order):
    body, simulation = case.body, Simulation(case, 1, 1e-9, order=order)
    nodes = surface_contacts(body)
    near = int(nodes[np.argmin(body.fine.nodes[nodes, 0])])
    carrying, shares = simulation.shares.of(near)
    assert shares[np.isin(carrying, simulation._held)].sum() > 0.1
    force = -0.2 * body.fine.normals[near]
    expected = simulation.displacement(Load.at(near, force))
    way = simulation.means(Load.at(near, force), expected)[0]
    found, forces = simulation.answer(Load((Press(near, moved=way),)))
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()
    assert np.abs(forces[0] - force).max() < 1e-6 * np.abs(force).max()


def test_the_force_is_the_work_of_going_deeper(case, places):
    """By differences of the stored energy, without any load in it: dE = f · d(way)."""
    one, _, _, force = places
    simulation = Simulation(case, 0, 1e-10)
    problem, moved = solved(case.body, 0, 1, [(one, force)])
    way = simulation.means(Load.at(one, force), moved)[0]
    problem.carry(np.zeros_like(moved))

    def stored(step):
        return problem.energy(problem.mesh.nodes + simulation.answer(Load((Press(one, moved=way + step),)))[0])

    forces = simulation.answer(Load((Press(one, moved=way),)))[1]
    steps = 1e-4 * np.linalg.norm(way) * np.eye(3)
    slopes = np.array([(stored(step) - stored(-step)) / (2.0 * np.linalg.norm(step)) for step in steps])
    assert np.abs(slopes - forces[0]).max() < 1e-5 * np.abs(forces).max()


def test_a_capped_search_comes_to_the_converged_force(case, places):
    one, *_, force = places
    way = Simulation(case, 0, 1e-9).means(
        Load.at(one, force), Simulation(case, 0, 1e-9).displacement(Load.at(one, force))
    )
    load = Load((Press(one, moved=way[0]),))
    errors = []
    for n in (1, 2, 3, 8):
        answer = FEM(order=1, level=0, iterations=n).prepare(case).respond(load)
        assert isinstance(answer, Answer)
        errors.append(np.linalg.norm(answer.forces[0] - force) / np.linalg.norm(force))
    assert errors[0] > 0.01 > 1e-6 > errors[-1] and errors[2] < errors[0]


@pytest.mark.parametrize("start", ["linear", "frame"])
def test_every_start_leads_to_the_same_depth(case, places, start):
    one, other, _, force = places
    load = Load((Press(one, moved=np.array([0.0, 0.002, -0.01])), Press(other, 0.3 * force)))
    cold, warm = (FEM(order=1, level=0, start=each, tolerance=TOLERANCE).prepare(case) for each in ("rest", start))
    warm.precede(load)
    expected, found = cold.respond(load), warm.respond(load)
    assert np.abs(found.displacement - expected.displacement).max() < 1e-6 * np.abs(expected.displacement).max()
    assert np.abs(found.forces - expected.forces).max() < 1e-6 * np.abs(expected.forces).max()


def test_without_a_disc_a_point_between_nodes_is_pushed(slab_case, places):
    """A force on a fine node does the work on the coarse mesh that its interpolated displacement says."""
    case, force = slab_case[0], places[3]
    body, node = case.body, places[2]
    for order in (1, 2):
        moved = Simulation(case, 0, 1e-9, order=order).nodal(Load.at(node, force))
        field = np.random.default_rng(0).normal(size=moved.shape)
        up = to_surface(body, 0, order)
        work = force @ (up @ field)[np.searchsorted(body.fine.surface, node)]
        assert np.vdot(moved, field) == pytest.approx(work, rel=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_linear_responses_add_up_and_find_forces(case, places, order):
    one, other, _, force = places
    case = replace(case, response=compute_compliance(case.body, RADIUS_M, order=order))
    linear = LinearFEM().prepare(case)
    presses = (Press(one, force), Press(other, -0.5 * force))
    both = linear.respond(Load(presses))
    assert np.allclose(both, sum(linear.respond(Load((press,))) for press in presses), rtol=1e-12, atol=0.0)
    problem = Equilibrium(finer(case.body), 1, order)
    nodal = sum(spread(case.body.fine, patch_at(case.body, p.node, RADIUS_M), p.force, order) for p in presses)
    exact = problem.linear_solver(1e-10)(nodal)
    assert np.abs(both - exact[case.body.fine.surface]).max() < 1e-6 * np.abs(both).max()
    ways = Simulation(case, 1, 1e-9, order=order).means(Load(presses), exact)
    pushed = tuple(Press(press.node, moved=way) for press, way in zip(presses, ways, strict=True))
    for load in (pushed, (presses[0], pushed[1])):
        answer = linear.respond(Load(load))
        assert np.abs(answer.displacement - both).max() < 1e-6 * np.abs(both).max()
        assert np.abs(answer.forces - [force, -0.5 * force]).max() < 1e-5 * np.abs(force).max()


def test_two_warped_responses_are_one_warp_of_their_sum(case, places):
    """To the first order they are linear; under large forces they are nearer to the elements' answer."""
    one, other, _, force = places
    warped, linear = WarpedCompliance().prepare(case), LinearFEM().prepare(case)

    def both(share):
        return Load((Press(one, share * force), Press(other, 0.3 * share * force)))

    small = linear.respond(both(1e-6))
    assert np.abs(warped.respond(both(1e-6)) - small).max() < 1e-5 * np.abs(small).max()
    exact = Simulation(case, 1, 1e-8).displacement(both(1.0))[case.body.fine.surface]
    off = [np.linalg.norm(each.respond(both(1.0)) - exact) for each in (warped, linear)]
    assert off[0] < 0.7 * off[1]
    given = both(1.0)
    moved = warped.respond(given)
    nodes, shares = ContactShares(case, 1).of(one)
    way = shares @ moved[np.searchsorted(case.body.fine.surface, nodes)]
    found = warped.respond(Load((Press(one, moved=way), given.presses[1])))
    assert np.abs(found.displacement - moved).max() < 1e-5 * np.abs(moved).max()
    assert np.abs(found.forces - [force, 0.3 * force]).max() < 1e-5 * np.abs(force).max()
    halves = Load((Press(one, 0.5 * force), Press(one, 0.5 * force)))
    assert np.allclose(warped.respond(halves), warped.respond(Load.at(one, force)), rtol=1e-9, atol=1e-15)


def test_a_search_for_forces_ends_or_says_that_it_does_not():
    gives, ways = np.diag([1.0, 2.0, 0.5]), np.array([[0.1, -0.2, 0.3]])

    def means(forces):
        return forces @ gives + 0.5 * forces**2

    found = find_forces(means, ways, gives)
    assert np.allclose(means(found), ways, atol=1e-6) and not find_forces(means, 0.0 * ways, gives).any()
    for bad in (lambda forces: np.full((1, 3), np.nan), lambda forces: np.full((1, 3), 0.3)):
        with pytest.raises(NotConverged, match="no force was found"):
            find_forces(bad, ways, gives)


@pytest.mark.parametrize(
    ("name", "kinds"),
    {
        "interpolation": {"depth": False, "two": False, "between": False},
        "linear_fem": {"depth": False, "two": False, "between": True},
        "warped_compliance": {"depth": True, "two": True, "between": True},  # with what was learnt
        "linear_residual": {"depth": True, "two": True, "between": True},
        "detail_correction": {"depth": True, "two": True, "between": True},
        "kernel_ridge_detail": {"depth": True, "two": True, "between": True},
        "unordered_nonnegative_b": {"depth": True, "two": True, "between": True},
        "springs": {"depth": True, "two": True, "between": False},
    }.items(),
)
def test_a_model_answers_or_refuses_in_one_sentence(case, places, grid, name, kinds):
    one, other, node, force = places
    solver = MODELS[name].tried(case, grid)[-1].prepare(case)
    loads = {
        "depth": Load((Press(one, moved=np.array([0.0, 0.0, -0.005])),)),
        "two": Load((Press(one, 0.3 * force), Press(other, 0.3 * force))),
        "between": Load.at(node, 0.3 * force),
    }
    for kind, refused in kinds.items():
        if refused:
            with pytest.raises((Refused, InputError)) as failure:
                solver.respond(loads[kind])
            assert 20 < len(str(failure.value)) < 150 and "\n" not in str(failure.value)
        else:
            answer = solver.respond(loads[kind])
            assert np.isfinite(answer.displacement if isinstance(answer, Answer) else answer).all()


def test_what_cannot_be_pushed_is_refused_and_never_nan(case, places):
    one, _, node, _ = places
    held, inner = int(case.body.anchors[1][0]), int(np.setdiff1d(np.arange(90), case.body.fine.surface)[0])
    solver, way = FEM(order=1, level=0, tolerance=TOLERANCE).prepare(case), np.array([0.0, 0.0, -0.005])
    for bad in (held, inner, len(case.body.fine.nodes), -1):
        with pytest.raises(InputError, match="not a free surface node"):
            solver.respond(Load((Press(bad, moved=way),)))
    with pytest.raises(InputError, match="same place"):
        solver.respond(Load((Press(node, moved=way), Press(node, moved=2 * way))))
    with pytest.raises(Refused, match="same place"):
        LinearFEM().prepare(case).respond(Load((Press(one, moved=way), Press(one, moved=way))))
    nothing = solver.respond(Load((Press(one, moved=np.zeros(3)),)))
    assert not nothing.displacement.any() and not nothing.forces.any()
    with pytest.raises(Refused, match="depth"):
        Load((Press(one, moved=way),)).single()


@pytest.mark.parametrize(
    "model", [WarpedCompliance(), ContactModes(modes="columns"), FEM(order=2, level=1, tolerance=TOLERANCE)]
)
def test_a_disc_that_is_held_beside_a_press_stays_where_it_is(case, places, model):
    """The force that holds it is that of the converged elements, to what the models differ by."""
    one, two, _, force = places
    load = Load((Press(one, 0.02 * force), Press(two, moved=np.zeros(3))))
    exact = FEM(order=2, level=1, tolerance=TOLERANCE).prepare(case).respond(load)
    found = model.prepare(case).respond(load)
    assert np.linalg.norm(exact.forces[1]) > 0
    # compliances are those of linear elements
    near = 0.3 if model.name == "warped_compliance" else 0.01
    assert np.linalg.norm(found.forces[1] - exact.forces[1]) < near * np.linalg.norm(exact.forces[1])


def test_presses_that_ask_for_nothing_or_for_two_things_are_refused():
    for wrong in ({}, {"force": np.ones(3), "moved": np.ones(3)}):
        with pytest.raises(InputError, match="either a force or a displacement"):
            Press(3, **wrong)
    for value in (np.nan, np.inf):
        with pytest.raises(InputError, match="not finite"):
            Press(3, moved=np.array([0.0, value, 0.0]))
    with pytest.raises(InputError, match="without a press"):
        Load(())
