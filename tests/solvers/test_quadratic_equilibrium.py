"""Equilibria of quadratic elements: balance, accuracy, preconditioning, and what is refused."""

import numpy as np
import pytest
from fixtures.direct import direct
from fixtures.manufactured import manufactured_errors, refined, swirl, swirl_force, vector_basis
from scipy import sparse
from skfem import BilinearForm, ElementTetP0, asm
from skfem.helpers import ddot, div, sym_grad

from palpate.bodies.body import Body, nest
from palpate.bodies.material import LAWS, Material
from palpate.bodies.refinement import refine
from palpate.bodies.simple_shapes import cylinder
from palpate.bodies.supports import Bed
from palpate.effects.bed import BedSprings
from palpate.effects.quadratic_elements import MeanDilatation, QuadraticElements
from palpate.linalg.multigrid import conjugate_gradients
from palpate.solvers.equilibrium import Equilibrium


def push(mesh, contact, force):
    load = np.zeros_like(mesh.nodes)
    load[contact] = force
    return load


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


def test_elastic_supports_hold_and_are_part_of_everything(slab):
    """A bed and one anchor: the linear answer, a balance and the preconditioner."""
    bed = Bed(slab.coarse.nodes.mean(axis=0), 0.1, 2e5)
    anchors = [slab.anchors[0][:1], slab.anchors[1][:1]]
    body = Body("resting", slab.levels, slab.prolongations, anchors, slab.material, bed=bed)
    load = push(slab.fine, 44, [0.0, 0.3, -0.2])
    for level, order in ((1, 1), (0, 2)):
        problem, springs = Equilibrium(body, level, order), BedSprings(slab.levels[level], bed, order).matrix
        solution = problem.solve(load, 1e-10)
        moved = solution.x - slab.fine.nodes
        force = problem.elements.force(solution.x) - (springs @ moved.ravel()).reshape(-1, 3) + load
        force[body.anchors[1]] = 0.0
        assert np.linalg.norm(force) < 1e-9 * np.linalg.norm(load)
        matrix = problem.elements.stiffness(slab.fine.nodes)
        expected = direct((matrix + springs).tobsr((3, 3)), body.anchors[1], load)
        assert np.abs(problem.linear_solver()(load) - expected).max() < 1e-8 * np.abs(expected).max()
        slope = (problem.energy(solution.x + 1e-6 * load) - problem.energy(solution.x - 1e-6 * load)) / 2e-6
        problem.load = np.zeros_like(load)
        other = (problem.energy(solution.x + 1e-6 * load) - problem.energy(solution.x - 1e-6 * load)) / 2e-6
        assert other == pytest.approx(-np.vdot(problem.force(solution.x), load), rel=1e-5)
        assert abs(slope) < 1e-4 * other


def paper_cylinder(poisson=0.3, law=LAWS[0]) -> Body:
    return nest("cylinder", cylinder(0.2, 0.03), 2, np.arange(19), Material(3000.0, poisson, 1000.0, law))


def bent(body, level, order, newtons=(0.01, 0.006, 0.0), tolerance=1e-8):
    """The cylinder's end pushed sideways: the problem, the nodes' positions, and how far the end has moved [m]."""
    problem = Equilibrium(body, level, order)
    end = np.flatnonzero(body.coarse.nodes[:, 2] > 0.2 - 1e-9)
    x = problem.solve(push(problem.mesh, end, np.array(newtons) / len(end)), tolerance).x
    return problem, x, np.linalg.norm((x - problem.mesh.nodes)[end].mean(axis=0))


def incompressible_bent(poisson, level, order, law=LAWS[0]):
    problem, _, moved = bent(paper_cylinder(poisson, law), level, order, (0.008, 0.004, 0.0), 1e-6)
    return moved, problem


def test_linear_multigrid_at_rest_preconditions_at_rest_and_far_from_it():
    """To 1e-9, on both levels."""
    body = paper_cylinder()
    for level in (0, 1):
        problem, x, _ = bent(body, level, 2)
        right = np.random.default_rng(0).normal(size=x.shape)
        right[body.anchors[level + 1]] = 0.0
        for place in (problem.mesh.nodes, x):
            multiply, precondition = problem.linearise(place)
            _, products, positive = conjugate_gradients(multiply, precondition, right, 1e-9, 100)
            assert positive and products <= (27 if place is not x else 33)


def test_quadratic_elements_bend_as_a_finer_mesh_does():
    """The coarse cylinder against quadratic elements of half the size; linear ones on the same nodes are too stiff."""
    body = paper_cylinder()
    linear, quadratic, finer = (bent(body, *which)[1][: len(body.coarse.nodes)] for which in ((1, 1), (0, 2), (1, 2)))
    peak = np.linalg.norm(finer - body.coarse.nodes, axis=1).max()
    assert 0.08 * body.coarse.size < peak < 0.15 * body.coarse.size
    errors = [np.sqrt(np.mean(np.sum((x - finer) ** 2, axis=1))) / peak for x in (linear, quadratic)]
    assert errors[0] > 0.03 and errors[1] < 0.005


def test_rest_stiffness_is_the_mixed_element_of_scikit_fem(box):
    """2μ ε : ε of quadratic elements, and Bᵀ M⁻¹ B λ with constant pressures, eliminated."""
    mesh = box([2, 1, 1], [0.2, 0.1, 0.1], jitter=0.2)
    finer, elasticity = refine(mesh)[0], MeanDilatation(mesh, Material(3000.0, 0.499, 1000.0))
    mu, lam = (modulus[0] for modulus in elasticity.moduli)
    basis, order = vector_basis(mesh, finer.nodes, 2)
    pressures = basis.with_element(ElementTetP0())
    shear = asm(BilinearForm(lambda u, v, w: 2 * mu * ddot(sym_grad(u), sym_grad(v))), basis)
    coupling = asm(BilinearForm(lambda u, q, w: div(u) * q), basis, pressures)
    mass = asm(BilinearForm(lambda p, q, w: p * q), pressures)
    whole = shear + lam * coupling.T @ sparse.diags_array(1.0 / mass.diagonal()) @ coupling
    expected = whole.toarray()[np.ix_(order, order)]
    found = elasticity.stiffness(finer.nodes).toarray()
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize(
    ("poisson", "least"),
    [(0.3, 2.8), pytest.param(0.499, 2.5, marks=pytest.mark.slow), pytest.param(0.4999, 2.5, marks=pytest.mark.slow)],
)
def test_errors_fall_as_theory_says_whatever_poissons_ratio(box, poisson, least):
    """A smooth flow without change of volume: the order of quadratic elements, and no error that grows with λ."""
    cubes = refined(box([2, 2, 2], [1, 1, 1]))
    errors, usual = (
        manufactured_errors(cubes, Material(3000.0, each, 1000.0), swirl, swirl_force, 2, (1, 2))[:, 0]
        for each in (poisson, 0.3)
    )
    assert np.log2(errors[0] / errors[1]) > least
    assert errors[1] < 3.0 * usual[1]


def test_equilibrium_chooses_the_elements(recwarn):
    kinds = {poisson: type(incompressible_bent(poisson, 0, 2)[1].elements) for poisson in (0.3, 0.45, 0.46)}
    assert kinds == {0.3: QuadraticElements, 0.45: QuadraticElements, 0.46: MeanDilatation}
    incompressible_bent(0.45, 1, 1)  # nor do linear ones lock there
    assert not recwarn.list
