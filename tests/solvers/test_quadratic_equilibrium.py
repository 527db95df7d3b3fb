"""Equilibria of quadratic elements: balance, accuracy, preconditioning, and what is refused."""

import numpy as np
import pytest
from fixtures.manufactured import body_force, wave
from scipy import sparse
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree
from skfem import Basis, ElementTetP2, ElementVector, Functional, LinearForm, MeshTet
from skfem.helpers import ddot, dot, grad

from palpate.bodies.body import Body, nest
from palpate.bodies.box import cylinder
from palpate.bodies.material import Material
from palpate.bodies.refinement import refine
from palpate.effects.quadratic_elements import QuadraticElements
from palpate.errors import InputError
from palpate.linalg.block_pattern import hold
from palpate.linalg.conjugate_gradients import conjugate_gradients
from palpate.solvers import equilibrium
from palpate.solvers.equilibrium import Equilibrium


def push(mesh, contact, force):
    load = np.zeros_like(mesh.nodes)
    load[contact] = force
    return load


def test_what_is_returned_is_in_balance(beam):
    """Checked with the elements alone."""
    problem = Equilibrium(beam, 0, order=2)
    load = push(problem.mesh, 265, [0.3, 0.2, -0.3])
    solution = problem.solve(load, 1e-9)
    force = QuadraticElements(beam.coarse, beam.material).force(solution.x) + load
    free = np.setdiff1d(np.arange(len(load)), beam.anchors[1])
    assert np.linalg.norm(force[free]) < 1e-9 * np.linalg.norm(load)
    assert np.array_equal(solution.x[beam.anchors[1]], beam.fine.nodes[beam.anchors[1]])
    assert np.abs(solution.x - beam.fine.nodes).max() > 0.1 * beam.fine.size


def test_midpoints_that_the_body_has_moved_are_put_back(slab):
    """The elements are straight-sided, whatever the surface of the next level is."""
    moved = slab.fine.nodes + 1e-3 * np.random.default_rng(0).normal(size=slab.fine.nodes.shape)
    moved[: len(slab.coarse.nodes)] = slab.coarse.nodes
    finer = type(slab.fine)(moved, slab.fine.tetrahedra)
    snapped = Body("snapped", [slab.coarse, finer], slab.prolongations, slab.anchors, slab.material)
    plain, other = (Equilibrium(body, 0, order=2) for body in (slab, snapped))
    assert np.array_equal(plain.mesh.nodes, other.mesh.nodes)
    load = push(plain.mesh, 44, [0.0, 0.1, -0.1])
    assert np.array_equal(plain.solve(load, 1e-8).x, other.solve(load, 1e-8).x)


def test_quadratic_elements_need_the_next_level(box, soft):
    mesh = box([1, 1, 1], [0.1, 0.1, 0.1])
    body = nest("cube", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)
    with pytest.raises(InputError, match=r"^cube: quadratic elements on level 1 need level 2; refine it once more\.$"):
        Equilibrium(body, 1, order=2)


@pytest.mark.parametrize("order", [1, 2])
def test_linear_solver_against_a_direct_one(slab, order):
    problem = Equilibrium(slab, 2 - order, order)
    matrix = QuadraticElements(slab.coarse, slab.material).stiffness(slab.fine.nodes)
    hold(matrix.indptr, matrix.indices, matrix.data, np.isin(np.arange(len(slab.fine.nodes)), slab.anchors[1]))
    load = np.random.default_rng(0).normal(size=slab.fine.nodes.shape)
    load[slab.anchors[1]] = 0.0
    expected = spsolve(matrix.tocsc(), load.ravel()).reshape(load.shape)
    wrong = np.abs(problem.linear_solver()(load) - expected).max() / np.abs(expected).max()
    assert wrong < 1e-8 if order == 2 else wrong > 0.05


def test_elastic_supports_hold_and_are_part_of_everything(slab, monkeypatch):
    """Springs to rest at all nodes, in place of anchors: the linear answer, a balance and the preconditioner."""
    n = [len(mesh.nodes) for mesh in slab.levels]
    diagonal = np.random.default_rng(1).uniform(1.0, 2.0, 3 * n[1])
    monkeypatch.setattr(
        equilibrium, "_springs", lambda body, level, order: sparse.diags_array(diagonal[: 3 * n[level + order - 1]])
    )
    body = Body("resting", slab.levels, slab.prolongations, [slab.anchors[0][:1], slab.anchors[1][:1]], slab.material)
    load = push(slab.fine, 44, [0.0, 0.3, -0.2])
    for level, order in ((1, 1), (0, 2)):
        problem = Equilibrium(body, level, order)
        solution = problem.solve(load, 1e-10)
        moved = solution.x - slab.fine.nodes
        force = problem._elasticity.force(solution.x) - diagonal.reshape(-1, 3) * moved + load
        force[body.anchors[1]] = 0.0
        assert np.linalg.norm(force) < 1e-9 * np.linalg.norm(load)
        matrix = problem._elasticity.stiffness(slab.fine.nodes)
        matrix = (matrix + sparse.diags_array(diagonal)).tobsr((3, 3))
        hold(matrix.indptr, matrix.indices, matrix.data, problem._held)
        expected = spsolve(matrix.tocsc(), np.where(problem._held[:, None], 0.0, load).ravel()).reshape(load.shape)
        assert np.abs(problem.linear_solver()(load) - expected).max() < 1e-8 * np.abs(expected).max()
        slope = (problem.energy(solution.x + 1e-6 * load) - problem.energy(solution.x - 1e-6 * load)) / 2e-6
        problem._load = np.zeros_like(load)
        other = (problem.energy(solution.x + 1e-6 * load) - problem.energy(solution.x - 1e-6 * load)) / 2e-6
        assert other == pytest.approx(-np.vdot(problem.force(solution.x), load), rel=1e-5)
        assert abs(slope) < 1e-4 * other


def boundary_forces(mesh, first_piola):
    """Nodal forces of the dead traction P N on the quadratic elements of the boundary: a third at each midpoint."""
    finer = refine(mesh)[0]
    a, b, c = (mesh.nodes[mesh.triangles[:, i]] for i in range(3))
    thirds = np.cross(b - a, c - a) / 6.0 @ first_piola.T
    forces, tree = np.zeros_like(finer.nodes), cKDTree(finer.nodes)
    for p, q in ((a, b), (b, c), (c, a)):
        np.add.at(forces, tree.query((p + q) / 2)[1], thirds)
    return forces


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_patch_tractions_make_a_large_affine_deformation(box, poisson):
    """x ↦ x + x₁ a keeps the held face in place, so P N on the other faces must give it exactly."""
    mesh, material = box([2, 2, 2], [0.1, 0.1, 0.1], jitter=0.2), Material(3000.0, poisson, 1000.0)
    body = nest("patch", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), material)
    f = np.eye(3)
    f[:, 0] += [0.25, 0.3, -0.2]
    u, s, v = np.linalg.svd(f)
    first_piola = 2 * material.shear_pa * (f - u @ v) + material.lame_pa * (s.sum() - 3.0) * u @ v
    problem = Equilibrium(body, 0, order=2)
    x = problem.solve(boundary_forces(mesh, first_piola), 1e-12).x
    assert np.abs(x - body.fine.nodes @ f.T).max() < 1e-10 * mesh.size


def quadratic_basis(mesh, nodes):
    """scikit-fem's quadratic vector elements on ``mesh``, and for each component of ``nodes`` its unknown there."""
    reference = MeshTet(mesh.nodes.T.copy(), mesh.tetrahedra.T.copy(), sort_t=False)
    basis = Basis(reference, ElementVector(ElementTetP2()), intorder=6)
    theirs = cKDTree(basis.doflocs[:, ::3].T).query(nodes)[1]
    return basis, (3 * theirs[:, None] + np.arange(3)).ravel()


def test_manufactured_solution_converges_as_theory_says(box, soft):
    """Error in L2 like h³, in H1 like h², on the levels of a cube held all around."""
    levels, prolongations = [box([2, 2, 2], [1, 1, 1])], []
    for _ in range(3):
        finer, prolongation = refine(levels[-1])
        levels.append(finer)
        prolongations.append(prolongation)
    body = Body("cube", levels, prolongations, [m.surface for m in levels], soft)
    errors = []
    for level in (0, 1, 2):
        nodes = levels[level + 1].nodes
        basis, order = quadratic_basis(levels[level], nodes)
        load = LinearForm(lambda v, w: dot(body_force(w.x, soft), v)).assemble(basis)[order].reshape(-1, 3)
        found = np.empty(len(order))
        found[order] = Equilibrium(body, level, order=2).linear_solver()(load).ravel()

        @Functional
        def value(w):
            return dot(w["u"] - wave(w.x)[0], w["u"] - wave(w.x)[0])

        @Functional
        def slope(w):
            return ddot(grad(w["u"]) - wave(w.x)[1], grad(w["u"]) - wave(w.x)[1])

        errors.append([np.sqrt(f.assemble(basis, u=basis.interpolate(found))) for f in (value, slope)])
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates[-1] >= [2.8, 1.8]).all() and (rates[-1] < [3.3, 2.3]).all()


def bent(body, level, order):
    """The cylinder's end pushed sideways by a tenth of its length: the problem and the nodes' positions."""
    problem = Equilibrium(body, level, order)
    end = np.flatnonzero(body.coarse.nodes[:, 2] > 0.2 - 1e-9)
    load = push(problem.mesh, end, np.array([0.01, 0.006, 0.0]) / len(end))
    return problem, problem.solve(load, 1e-8).x


def test_linear_multigrid_at_rest_preconditions_at_rest_and_far_from_it(soft):
    """To 1e-9, on both levels."""
    body = nest("cylinder", cylinder(0.2, 0.03), 2, np.arange(19), soft)
    for level in (0, 1):
        problem, x = bent(body, level, 2)
        right = np.random.default_rng(0).normal(size=x.shape)
        right[body.anchors[level + 1]] = 0.0
        for place in (problem.mesh.nodes, x):
            multiply, precondition = problem.linearise(place)
            _, products, positive = conjugate_gradients(multiply, precondition, right, 1e-9, 100)
            assert positive and products <= (27 if place is not x else 33)


def test_quadratic_elements_bend_as_a_finer_mesh_does(soft):
    """The coarse cylinder against quadratic elements of half the size; linear ones on the same nodes are too stiff."""
    body = nest("cylinder", cylinder(0.2, 0.03), 2, np.arange(19), soft)
    linear, quadratic, finer = (bent(body, *which)[1][: len(body.coarse.nodes)] for which in ((1, 1), (0, 2), (1, 2)))
    peak = np.linalg.norm(finer - body.coarse.nodes, axis=1).max()
    assert 0.08 * body.coarse.size < peak < 0.15 * body.coarse.size
    errors = [np.sqrt(np.mean(np.sum((x - finer) ** 2, axis=1))) / peak for x in (linear, quadratic)]
    assert errors[0] > 0.03 and errors[1] < 0.005
