"""Patch tests, uniaxial traction, manufactured solutions, scikit-fem's answers and the elastica."""

import numpy as np
import pytest
from fixtures.manufactured import body_force, boundary_forces, manufactured_errors, refined, vector_basis, wave
from scipy.integrate import solve_bvp
from scipy.linalg import polar
from scipy.sparse.linalg import spsolve
from skfem import condense
from skfem.models.elasticity import linear_elasticity

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.solvers.equilibrium import Equilibrium


def stress(f, material):
    """First Piola–Kirchhoff stress 2μ (F − R) + λ tr(S − I) R [Pa], by scipy's polar decomposition."""
    r, s = polar(f)
    return 2 * material.shear_pa * (f - r) + material.lame_pa * np.trace(s - np.eye(3)) * r


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize(("level", "order"), [(0, 1), (1, 1), (0, 2)])
def test_patch_tractions_make_a_large_affine_deformation(box, poisson, level, order):
    """x ↦ x + x₁ a keeps the held face in place, so P N on the other faces must give it exactly."""
    mesh = box([2, 2, 2], [0.1, 0.1, 0.1], jitter=0.2)
    held = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    body = nest("patch", mesh, level + order - 1, held, Material(3000.0, poisson, 1000.0))
    f = np.eye(3)
    f[:, 0] += [0.25, 0.3, -0.2]
    load = boundary_forces(body.levels[level], stress(f, body.material), order)
    solution = Equilibrium(body, level, order).solve(load, 1e-12)
    assert np.abs(solution.x - body.fine.nodes @ f.T).max() < 1e-10 * mesh.size


@pytest.mark.parametrize(
    ("order", "cells", "chosen"), [pytest.param(1, 3, (1, 2, 3), marks=pytest.mark.slow), (2, 2, (0, 1, 2))]
)
def test_manufactured_solution_converges_as_theory_says(box, soft, order, cells, chosen):
    """Error in L2 like h² and in H1 like h with linear elements, like h³ and h² with quadratic ones."""
    cubes = refined(box([cells] * 3, [1, 1, 1]))
    errors = manufactured_errors(cubes, soft, wave, body_force, order, chosen)
    rates = np.log2(errors[:-1] / errors[1:])
    if order == 1:
        assert (np.abs(rates[1] - [2, 1]) < np.abs(rates[0] - [2, 1])).all()
        assert rates[-1] == pytest.approx([2.0, 1.0], abs=0.1)
    else:
        assert (rates[-1] >= [2.8, 1.8]).all() and (rates[-1] < [3.3, 2.3]).all()


def test_small_loads_give_scikit_fems_linear_answer(beam):
    """What differs is of first order in the load, and cancels to second order between a load and its opposite."""
    load = np.zeros_like(beam.fine.nodes)
    load[200] = [2.0, 1.0, -1.0]
    basis, unknowns = vector_basis(beam.fine, beam.fine.nodes, 1)
    assert np.array_equal(unknowns, np.arange(basis.N))
    matrix = linear_elasticity(beam.material.lame_pa, beam.material.shear_pa).assemble(basis)
    held = basis.nodal_dofs[:, beam.anchors[1]].ravel()
    system, right, x, free = condense(matrix, load.ravel(), D=held)
    x[free] = spsolve(system.tocsc(), right)
    expected = x.reshape(-1, 3)
    solver, peak = Equilibrium(beam, 1), np.abs(expected).max()

    def response(newtons, tolerance):
        return (solver.solve(newtons * load, tolerance).x - beam.fine.nodes) / newtons

    tiny, small = (np.abs(response(n, t) - expected).max() / peak for n, t in ((1e-7, 1e-6), (1e-6, 1e-7)))
    assert tiny < 1e-6
    assert small / tiny == pytest.approx(10, rel=0.1)
    mean = (response(1e-6, 1e-7) + response(-1e-6, 1e-7)) / 2
    assert np.abs(mean - expected).max() < 1e-8 * peak


def elastica(load):
    """Tip of a cantilever of length 1 under ``load`` = PL²/EI across its rest axis: (shortening, deflection)."""
    s = np.linspace(0, 1, 101)
    solution = solve_bvp(
        lambda s, y: np.array([y[1], -load * np.cos(y[0])]),
        lambda base, tip: np.array([base[0], tip[1]]),
        s,
        np.array([s, 1 - s]),
        tol=1e-9,
    )
    s = np.linspace(0, 1, 10001)
    angle = solution.sol(s)[0]
    return np.array([1 - np.trapezoid(np.cos(angle), s), np.trapezoid(np.sin(angle), s)])


def test_elastica_is_the_tabulated_one():
    """Bisshopp and Drucker 1945: PL²/EI = 2 deflects by 0.4935 and shortens by 0.1606 of the length."""
    assert elastica(2.0) == pytest.approx([0.1606, 0.4935], abs=1e-4)
    assert elastica(1e-3)[1] == pytest.approx(1e-3 / 3, rel=1e-5)


def bent_bar(box, slender, across, level, load):
    """Tip of a bar of ``slender`` × 1 × 1 with ``across`` · 2^level elements over its height, as in ``elastica``."""
    mesh = box([slender * across, 1, across], [slender, 1, 1])
    body = nest("bar", mesh, level, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(1e5, 0.0, 1000.0))
    fine = body.fine
    end = fine.triangles[(fine.nodes[fine.triangles][:, :, 0] == slender).all(axis=1)]
    a, b, c = (fine.nodes[end[:, i]] for i in range(3))
    thirds = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    share = np.bincount(end.ravel(), np.repeat(thirds, 3), minlength=len(fine.nodes))
    newtons = load * 1e5 / 12 / slender**2
    x = Equilibrium(body, level).solve(np.outer(share, [0.0, 0.0, newtons]), 1e-6).x
    moved = share @ (x - fine.nodes) / slender
    return np.array([-moved[0], moved[2]])


@pytest.mark.slow
@pytest.mark.parametrize("load", [2.0, 4.0])
def test_large_deflection_converges_to_the_elastica(box, load):
    """The error of linear elements falls like h²; what is left is the stretch and shear that the elastica lacks."""
    slender = 20
    tips = np.array([bent_bar(box, slender, across, 1, load) for across in (2, 4, 8)])
    steps = np.diff(tips, axis=0)
    assert np.log2(steps[0] / steps[1]) == pytest.approx(2.0, abs=0.2)
    errors = np.abs(tips - elastica(load))
    assert (np.diff(errors, axis=0) < 0).all() and errors[-1].max() < 0.003
    limit = tips[-1] + steps[-1] / 3
    assert np.abs(limit - elastica(load)).max() < 0.75 / slender**2
