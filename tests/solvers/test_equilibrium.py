"""Equilibria of bodies: balance, a direct solver, load steps, numbering, and what is refused."""

from functools import partial

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.effects.linear_elements import LinearElements
from palpate.errors import InputError, NotConverged
from palpate.linalg import conjugate_gradients
from palpate.linalg.block_pattern import hold
from palpate.solvers import equilibrium
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.newton import minimise


def push(body, level, contact, force):
    load = np.zeros_like(body.levels[level].nodes)
    load[contact] = force
    return load


@pytest.mark.parametrize("level", [0, 1])
def test_linear_solver_against_a_direct_one(slab, level):
    mesh = slab.levels[level]
    matrix = LinearElements(mesh, slab.material).stiffness(mesh.nodes)
    hold(matrix.indptr, matrix.indices, matrix.data, np.isin(np.arange(len(mesh.nodes)), slab.anchors[level]))
    load = np.random.default_rng(0).normal(size=mesh.nodes.shape)
    load[slab.anchors[level]] = 0.0
    expected = spsolve(matrix.tocsc(), load.ravel()).reshape(load.shape)
    solver = Equilibrium(slab, level).linear_solver()
    assert np.abs(solver(load) - expected).max() < 1e-8 * np.abs(expected).max()
    loaded_anchors = load.copy()
    loaded_anchors[slab.anchors[level]] = 1.0
    assert np.array_equal(solver(loaded_anchors), solver(load))
    assert not solver(np.zeros_like(load)).any()


def test_linear_solver_says_when_it_fails(slab, monkeypatch):
    monkeypatch.setattr(conjugate_gradients, "MAX_PRODUCTS", 2)
    with pytest.raises(NotConverged, match="after 2 products") as failure:
        Equilibrium(slab, 1).linear_solver()(push(slab, 1, 40, [0, 0, 1.0]))
    assert 1e-9 < failure.value.history[0] < 1.0


def test_what_is_returned_is_in_balance(beam):
    """Checked with the elasticity alone; the anchors bear the whole load and its moment."""
    load = push(beam, 1, 265, [0.5, 0.3, -0.4])
    solution = Equilibrium(beam, 1).solve(load, 1e-9)
    force = LinearElements(beam.fine, beam.material).force(solution.x) + load
    free = np.setdiff1d(np.arange(len(load)), beam.anchors[1])
    assert np.linalg.norm(force[free]) < 1e-9 * np.linalg.norm(load)
    assert solution.history[-1] == pytest.approx(np.linalg.norm(force[free]) / np.linalg.norm(load), rel=1e-3)
    assert np.array_equal(solution.x[beam.anchors[1]], beam.fine.nodes[beam.anchors[1]])
    assert np.abs(solution.x - beam.fine.nodes).max() > 0.2 * beam.fine.size
    assert force[beam.anchors[1]].sum(axis=0) == pytest.approx(load.sum(axis=0), rel=1e-7)
    moments = [np.cross(solution.x, f).sum(axis=0) for f in (force, load)]
    assert moments[0] == pytest.approx(moments[1], rel=1e-6)


def test_no_load_needs_no_iteration(slab):
    solver = Equilibrium(slab, 1)
    held = push(slab, 1, slab.anchors[1][0], [1.0, 2.0, 3.0])
    for load in (np.zeros_like(slab.fine.nodes), held):
        solution = solver.solve(load, 1e-10)
        assert np.array_equal(solution.x, slab.fine.nodes)
        assert solution.history == [0.0] and solution.iterations == 0


def test_starting_near_the_answer_gives_the_same_answer(slab):
    solver, load = Equilibrium(slab, 1), push(slab, 1, 44, [0.0, 0.3, -0.4])
    cold = solver.solve(load, 1e-11)
    warm = solver.solve(load, 1e-11, start=cold.x + np.outer(slab.fine.nodes[:, 0], [0.0, 1e-4, 1e-4]))
    assert warm.iterations < cold.iterations
    assert np.abs(warm.x - cold.x).max() < 1e-9 * slab.fine.size


def test_solving_leaves_nothing_behind(slab):
    """The second solution is the first, bit for bit, whatever was solved in between."""
    solver, load = Equilibrium(slab, 1), push(slab, 1, 44, [0.0, 0.3, -0.4])
    before, kept = solver.solve(load, 1e-8), slab.fine.nodes.copy()
    solver.solve(push(slab, 1, 41, [0.5, 0.0, 0.2]), 1e-8)
    assert np.array_equal(solver.solve(load, 1e-8).x, before.x)
    assert np.array_equal(slab.fine.nodes, kept)


def renumbered(body, seed):
    """The same body with coarse nodes, elements and their corners in another order, and the nodes' new numbers."""
    random = np.random.default_rng(seed)
    order = random.permutation(len(body.coarse.nodes))
    new = np.argsort(order)
    elements = random.permutation(new[body.coarse.tetrahedra])[:, [1, 2, 0, 3]]  # an even permutation of corners
    mesh = TetMesh(body.coarse.nodes[order], elements)
    return nest("other", mesh, len(body.levels) - 1, new[body.anchors[0]], body.material), new


@pytest.mark.parametrize("which", ["slab", "unrefined cylinder"])
def test_solution_does_not_depend_on_numbering(slab, beam, which):
    """On the slab with multigrid: it is irregular, so that no tie between diagonals is broken by numbers."""
    body, contact, force = slab, 44, [0.0, 0.3, -0.4]
    if which != "slab":
        body, contact, force = Body("fine", [beam.fine], [], [beam.anchors[1]], beam.material), 265, [0.03, 0.02, -0.03]
    level = len(body.levels) - 1
    other, new = renumbered(body, 1)
    here = Equilibrium(body, level).solve(push(body, level, contact, force), 1e-12).x
    there = Equilibrium(other, level).solve(push(other, level, new[contact], force), 1e-12).x
    distance, match = cKDTree(other.fine.nodes).query(body.fine.nodes)
    assert distance.max() < 1e-15 and len(np.unique(match)) == len(match)
    assert np.abs(here - body.fine.nodes).max() > 0.05 * body.fine.size
    assert np.abs(here - there[match]).max() < 1e-9 * body.fine.size


def test_load_steps_reach_the_same_equilibrium(slab, monkeypatch):
    """Allowed only few iterations at a time, the solver must divide the load, and tell all that it took."""
    load = push(slab, 1, 44, [0.0, 0.3, -0.4])
    whole = Equilibrium(slab, 1).solve(load, 1e-10)
    calls = []

    def impatient(problem, x, scale, tolerance, solution):
        calls.append(tolerance)
        return minimise(problem, x, scale, tolerance, max_iterations=whole.iterations - 2, solution=solution)

    monkeypatch.setattr(equilibrium, "minimise", impatient)
    stepped = Equilibrium(slab, 1).solve(load, 1e-10)
    assert len(calls) >= 3 and calls[-1] == 1e-10
    assert stepped.iterations > whole.iterations
    assert stepped.linear_solves > whole.linear_solves and stepped.products > whole.products
    assert len(stepped.seconds) == len(stepped.history) and np.all(np.diff(stepped.seconds) >= 0)
    assert np.abs(stepped.x - whole.x).max() < 1e-8 * slab.fine.size


def test_gives_up_below_the_smallest_step(slab, monkeypatch):
    monkeypatch.setattr(equilibrium, "minimise", partial(minimise, max_iterations=0))
    with pytest.raises(NotConverged, match=r"at 2% of the load in steps of 1\.6%") as failure:
        Equilibrium(slab, 1).solve(push(slab, 1, 44, [0.0, 0.0, -1.0]), 1e-8)
    assert failure.value.history == [pytest.approx(1 / 2**k, rel=1e-9) for k in range(7)]


@pytest.mark.parametrize("newtons", [1e1, 1e3, 1e5])
def test_monstrous_loads_converge_or_say_so(box, soft, newtons):
    """Up to ten thousand times what turns the first elements inside out; never a result that is none."""
    mesh = box([3, 2, 2], [0.15, 0.1, 0.1], jitter=0.2)
    body = nest("box", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)
    contact = int(np.argmin(np.linalg.norm(mesh.nodes - [0.1, 0.05, 0.1], axis=1)))
    load = push(body, 1, contact, [0.0, 0.0, -newtons])
    try:
        solution = Equilibrium(body, 1).solve(load, 1e-8)
    except NotConverged as failure:
        assert len(failure.history) > 1 and np.isfinite(failure.history).all()
    else:
        force = LinearElements(body.fine, soft).force(solution.x) + load
        force[body.anchors[1]] = 0.0
        assert np.linalg.norm(force) < 1e-8 * newtons
        assert TetMesh(solution.x, body.fine.tetrahedra).volumes.min() < 0.0


def test_a_body_that_nothing_holds_is_refused(box, soft):
    mesh = box([1, 1, 1], [0.1, 0.1, 0.1])
    loose = Body("loose", [mesh], [], [np.array([], dtype=int)], soft)
    with pytest.raises(InputError, match=r"^loose: nothing is held.*give it anchors or a bed\.$"):
        Equilibrium(loose, 0)


def test_a_residual_that_rounding_alone_leaves_is_accepted(box):
    """So light a load on a nearly incompressible body asks for more digits than positions have."""
    mesh = box([4, 2, 2], [0.2, 0.05, 0.05])
    body = nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(3000.0, 0.4999, 1000.0))
    solution = Equilibrium(body, 1).solve(push(body, 1, len(mesh.nodes) - 1, [0.0, 0.0, -1e-4]), 1e-10)
    assert 1e-10 < solution.history[-1] < 1e-4
    linear = Equilibrium(body, 1).linear_solver(1e-6)(push(body, 1, len(mesh.nodes) - 1, [0.0, 0.0, -1e-4]))
    moved = solution.x - body.fine.nodes
    assert np.abs(moved - linear).max() < 0.01 * np.abs(linear).max()
