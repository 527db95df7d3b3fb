"""Equilibria of bodies: patch tests, a direct solver, load steps, numbering, and what is refused."""

from functools import partial

import numpy as np
import pytest
from scipy.linalg import polar
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from palpate.bodies.body import Body, Material, nest
from palpate.bodies.mesh import TetMesh
from palpate.effects.blocks import hold
from palpate.effects.corotational import Corotational
from palpate.errors import InputError, NotConverged
from palpate.solvers import equilibrium
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.newton import minimise


def stress(f, material):
    """First Piola–Kirchhoff stress 2μ (F − R) + λ tr(S − I) R [Pa], by scipy's polar decomposition."""
    r, s = polar(f)
    return 2 * material.shear_pa * (f - r) + material.lame_pa * np.trace(s - np.eye(3)) * r


def boundary_forces(mesh, first_piola):
    """∫ P N over the boundary, as nodal forces (n_nodes, 3) [N]."""
    a, b, c = (mesh.nodes[mesh.triangles[:, i]] for i in range(3))
    thirds = np.cross(b - a, c - a) / 6.0 @ first_piola.T
    forces = np.zeros_like(mesh.nodes)
    for corner in range(3):
        np.add.at(forces, mesh.triangles[:, corner], thirds)
    return forces


def push(body, level, contact, force):
    load = np.zeros_like(body.levels[level].nodes)
    load[contact] = force
    return load


class Supported:
    """A mesh with single components held: ``held`` (n_nodes, 3) bool stay where Newton's method starts."""

    def __init__(self, mesh, material, held, load):
        self._elasticity, self._held, self._load, self._rest = Corotational(mesh, material), held, load, mesh.nodes

    def energy(self, x):
        return self._elasticity.energy(x) - np.vdot(self._load, x - self._rest)

    def force(self, x):
        return np.where(self._held, 0.0, self._elasticity.force(x) + self._load)

    def linearise(self, x, definite):
        matrix = self._elasticity.stiffness(x, definite).toarray()
        held = self._held.ravel()
        matrix[held], matrix[:, held], matrix[held, held] = 0.0, 0.0, 1.0
        inverse = np.linalg.pinv(matrix)
        return (lambda p: (matrix @ p.ravel()).reshape(p.shape)), (lambda p: (inverse @ p.ravel()).reshape(p.shape))


AFFINE = np.array([[1.2, 0.1, -0.05], [0.0, 0.9, 0.15], [0.1, -0.1, 1.1]])


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_patch_affine_deformations_leave_no_inner_force(box, rotation, poisson):
    """Inner nodes of an irregular mesh are in balance, those of the boundary bear P N."""
    mesh, material = box([3, 3, 3], [0.1, 0.1, 0.1], jitter=0.2), Material(3000.0, poisson, 1000.0)
    f = rotation(1.3) @ AFFINE
    force = Corotational(mesh, material).force(mesh.nodes @ f.T + [1.0, 2.0, 3.0])
    expected = -boundary_forces(mesh, stress(f, material))
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.surface)
    assert len(inner) == 8 and np.abs(expected[inner]).max() < 1e-16
    assert np.abs(force - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_patch_a_moved_boundary_moves_inner_nodes_affinely(box, rotation, poisson):
    mesh, material = box([3, 3, 3], [0.1, 0.1, 0.1], jitter=0.2), Material(3000.0, poisson, 1000.0)
    exact = mesh.nodes @ (rotation(0.4) @ AFFINE).T
    held = np.isin(np.arange(len(mesh.nodes)), mesh.surface)
    start = np.where(held[:, None], exact, mesh.nodes)
    problem = Supported(mesh, material, np.repeat(held[:, None], 3, axis=1), np.zeros_like(exact))
    x = minimise(problem, start, material.young_pa * mesh.size**2, 1e-13).x
    assert np.abs(x - start).max() > 0.1 * mesh.size
    assert np.abs(x - exact).max() < 1e-10 * mesh.size


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("level", [0, 1])
def test_patch_tractions_make_a_large_affine_deformation(box, poisson, level):
    """x ↦ x + x₁ a keeps the held face in place, so P N on the other faces must give it exactly."""
    mesh = box([2, 2, 2], [0.1, 0.1, 0.1], jitter=0.2)
    held = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    body = nest("patch", mesh, level, held, Material(3000.0, poisson, 1000.0))
    f = np.eye(3)
    f[:, 0] += [0.25, 0.3, -0.2]
    solution = Equilibrium(body, level).solve(boundary_forces(body.fine, stress(f, body.material)), 1e-12)
    assert np.abs(solution.x - body.fine.nodes @ f.T).max() < 1e-10 * mesh.size


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("pull", [1e-3, 0.4, -0.3])
def test_uniaxial_traction(box, poisson, pull):
    """On symmetry supports a bar under nominal traction T = E ε stretches by ε and thins by ν ε, however large T is."""
    mesh, material = box([3, 2, 2], [0.3, 0.1, 0.1], jitter=0.2), Material(3000.0, poisson, 1000.0)
    load = boundary_forces(mesh, np.diag([pull * material.young_pa, 0.0, 0.0]))
    load[mesh.nodes[:, 0] == 0.0] = 0.0
    x = minimise(Supported(mesh, material, mesh.nodes == 0.0, load), mesh.nodes, np.linalg.norm(load), 1e-9).x
    strain = np.ptp(x, axis=0) / np.ptp(mesh.nodes, axis=0) - 1.0
    assert strain[0] == pytest.approx(pull, rel=1e-4)
    assert strain[1:] == pytest.approx(-poisson * pull, rel=1e-4, abs=1e-9)
    assert np.abs(x - mesh.nodes * (1.0 + strain)).max() < 1e-9 * mesh.size


def test_a_pulled_bar_without_poissons_effect(box):
    """Then the held face does not hinder it: the strain is σ/E everywhere."""
    mesh = box([4, 2, 2], [0.2, 0.1, 0.1], jitter=0.2)
    body = nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(3000.0, 0.0, 1000.0))
    load = boundary_forces(body.fine, np.diag([150.0, 0.0, 0.0]))
    x = Equilibrium(body, 1).solve(load, 1e-10).x
    assert np.abs(x - body.fine.nodes * [1.05, 1.0, 1.0]).max() < 1e-8 * mesh.size


@pytest.mark.parametrize("level", [0, 1])
def test_linear_solver_against_a_direct_one(slab, level):
    mesh = slab.levels[level]
    matrix = Corotational(mesh, slab.material).stiffness(mesh.nodes)
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
    few = partial(equilibrium.conjugate_gradients)
    monkeypatch.setattr(equilibrium, "conjugate_gradients", lambda *a: few(*a[:4], 2))
    with pytest.raises(NotConverged, match="after 2 products") as failure:
        Equilibrium(slab, 1).linear_solver()(push(slab, 1, 40, [0, 0, 1.0]))
    assert 1e-9 < failure.value.history[0] < 1.0


def test_what_is_returned_is_in_balance(beam):
    """Checked with the elasticity alone; the anchors bear the whole load and its moment."""
    load = push(beam, 1, 265, [0.5, 0.3, -0.4])
    solution = Equilibrium(beam, 1).solve(load, 1e-9)
    force = Corotational(beam.fine, beam.material).force(solution.x) + load
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

    def impatient(problem, x, scale, tolerance):
        calls.append(tolerance)
        return minimise(problem, x, scale, tolerance, max_iterations=whole.iterations - 2)

    monkeypatch.setattr(equilibrium, "minimise", impatient)
    stepped = Equilibrium(slab, 1).solve(load, 1e-10)
    assert len(calls) >= 3 and calls[-1] == 1e-10
    assert stepped.iterations > whole.iterations
    assert np.abs(stepped.x - whole.x).max() < 1e-8 * slab.fine.size


def test_gives_up_below_the_smallest_step(slab, monkeypatch):
    monkeypatch.setattr(equilibrium, "minimise", partial(minimise, max_iterations=0))
    with pytest.raises(NotConverged, match=r"at 2% of the load in steps of 1\.6%") as failure:
        Equilibrium(slab, 1).solve(push(slab, 1, 44, [0.0, 0.0, -1.0]), 1e-8)
    assert failure.value.history == [pytest.approx(1 / 2**k, rel=1e-9) for k in range(7)]


@pytest.mark.parametrize("newtons", [1e1, 1e3, 1e5])
def test_monstrous_loads_converge_or_say_so(box, soft, newtons):
    """Up to a hundred thousand times what turns the first elements inside out; never a result that is none."""
    mesh = box([3, 2, 2], [0.15, 0.1, 0.1], jitter=0.2)
    body = nest("box", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)
    contact = int(np.argmin(np.linalg.norm(mesh.nodes - [0.1, 0.05, 0.1], axis=1)))
    load = push(body, 1, contact, [0.0, 0.0, -newtons])
    try:
        solution = Equilibrium(body, 1).solve(load, 1e-8)
    except NotConverged as failure:
        assert len(failure.history) > 1 and np.isfinite(failure.history).all()
    else:
        force = Corotational(body.fine, soft).force(solution.x) + load
        force[body.anchors[1]] = 0.0
        assert np.linalg.norm(force) < 1e-8 * newtons
        assert TetMesh(solution.x, body.fine.tetrahedra).volumes.min() < 0.0


def test_a_body_that_nothing_holds_is_refused(box, soft):
    mesh = box([1, 1, 1], [0.1, 0.1, 0.1])
    loose = Body("loose", [mesh], [], [np.array([], dtype=int)], soft)
    with pytest.raises(InputError, match=r"^loose: nothing is held.*give it anchors\.$"):
        Equilibrium(loose, 0)
