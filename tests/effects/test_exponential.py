"""The exponential law against Demiray's closed stresses, its limits, and elements and equilibria under large strain."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from scipy.optimize import brentq

from palpate.benchmark.load import Refused
from palpate.bodies.body import nest
from palpate.bodies.material import Material, exponential
from palpate.bodies.particles import particles_of
from palpate.effects.law import evaluate, fault, law_of
from palpate.effects.laws.exponential import LARGEST
from palpate.effects.linear_elements import LinearElements
from palpate.errors import InputError
from palpate.models.relaxed import refuse_law
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.relaxed_parts import RelaxedParts
from palpate.solvers.system import System

MU, LAM, B = 1100.0, 1700.0, 6.0
STRETCHES = [0.5, 0.8, 1.0, 1.2, 1.6]
STRETCHED = np.array([1.3, 1.1, 0.7])


def principal(s, b=B, lam=LAM):
    """Cauchy's principal stresses (3,) [Pa] at the stretches ``s`` (3,)."""
    return evaluate(law_of(exponential(b)), s, MU, lam)[1] * np.asarray(s) / np.prod(s)


@pytest.mark.parametrize("b", [0.0, 1e-6, 1.0, 30.0])
def test_at_rest_it_has_the_moduli_whatever_the_stiffening(b):
    assert fault(law_of(exponential(b))) == ""


@pytest.mark.slow
def test_two_stiffenings_compiled_at_a_time_are_not_taken_for_each_other(monkeypatch, tmp_path):
    """What two processes compile of two stiffenings has one symbol, so that neither is stored for a third."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    soft, stiff = (evaluate(law_of.__wrapped__(exponential(b)), STRETCHED, MU, LAM)[0] for b in (1.25, 7.75))
    assert not list(tmp_path.rglob("exponential.shape_of*"))
    again = evaluate(law_of.__wrapped__(exponential(1.25)), STRETCHED, MU, LAM)[0]
    assert again == soft < stiff


@pytest.mark.parametrize("stretch", STRETCHES)
def test_tension_of_what_keeps_its_volume_is_demirays(stretch):
    """With I₁ = tr FFᵀ and W′ = ∂W/∂I₁: 2 W′ (λ² − 1/λ) along one axis, 2 W′ (λ² − λ⁻⁴) along two (Demiray 1972)."""
    one, two = (stretch, stretch**-0.5, stretch**-0.5), (stretch, stretch, stretch**-2.0)
    for s, shape in ((one, stretch**2 - 1 / stretch), (two, stretch**2 - stretch**-4.0)):
        found = principal(s)
        expected = MU * np.exp(B * (np.sum(np.square(s)) - 3.0)) * shape
        assert found[0] - found[2] == pytest.approx(expected, rel=1e-12, abs=1e-9 * MU)


@pytest.mark.parametrize("shear", [0.1, 0.5, 1.0])
def test_shear_and_normal_stresses_in_simple_shear_are_demirays(shear):
    """τ = μ γ exp(b γ²), and τ₁₁ − τ₂₂ = γ τ, which holds of every isotropic law (Rivlin)."""
    u, s, vt = np.linalg.svd(np.array([[1.0, shear, 0], [0, 1, 0], [0, 0, 1]]))
    cauchy = u @ np.diag(principal(s)) @ u.T
    tau = MU * shear * np.exp(B * shear**2)
    assert cauchy[0, 1] == pytest.approx(tau, rel=1e-11)
    assert cauchy[0, 0] - cauchy[1, 1] == pytest.approx(shear * tau, rel=1e-11)
    assert np.linalg.det(vt) * np.linalg.det(u) == pytest.approx(1.0)


def test_without_stiffening_it_is_neo_hookean():
    """Exactly for b = 0, and to first order of b Q beside it."""
    for s in ([1.3, 1.1, 0.7], [1.1, 1.1, 0.6], [0.5, 0.3, 0.2]):
        expected = evaluate(law_of("neo_hookean"), s, MU, LAM)
        q = np.sum(np.square(s)) - 3.0 - 2.0 * np.log(np.prod(s))
        for b in (0.0, 1e-9, 1e-4):
            for found, known in zip(evaluate(law_of(exponential(b)), s, MU, LAM), expected, strict=True):
                assert np.abs(found - known).max() <= (1e-12 + 40.0 * b * (1.0 + q)) * np.abs(known).max()


def test_no_strain_is_nan_and_none_costs_less_than_a_smaller_one():
    """Energies grow up to infinity along each ray from rest, where a line search backs off; derivatives stay finite."""
    ways = np.random.default_rng(0).normal(size=(40, 3))
    for b in (0.01, 8.0, 1000.0):
        for way in [*ways, *np.eye(3), *-np.eye(3)]:
            found = []
            for step in [0.0, *np.geomspace(1e-3, 1e9, 60)]:
                energy, gradient, hessian = evaluate(law_of(exponential(b)), 1.0 + step * way, MU, LAM)
                found.append(energy)
                assert not np.isnan(energy) and np.isfinite(gradient).all() and np.isfinite(hessian).all()
            with np.errstate(invalid="ignore"):
                assert not (np.diff(found) < 0.0).any()
    # just below the largest exponent everything is a number
    largest = brentq(lambda s: 8.0 * (s**2 - 1.0 - 2.0 * np.log(s)) - 0.999 * LARGEST, 1.0, 100.0)
    for part in evaluate(law_of(exponential(8.0)), [largest, 1.0, 1.0], 1e9, 1e9):
        assert np.isfinite(part).all()
    assert evaluate(law_of(exponential(8.0)), [1.01 * largest, 1.0, 1.0], 1e9, 1e9)[0] == np.inf


def test_waves_run_in_every_direction_at_any_strain(rotation):
    """Legendre and Hadamard: W, as a convex function of F and det F, curves upwards along every a ⊗ n."""
    law, rng, h = law_of(exponential(4.0)), np.random.default_rng(1), 1e-3

    def energy(f):
        return evaluate(law, np.linalg.svd(f)[1], 1.0, 0.0)[0]

    for _ in range(300):
        f = np.eye(3) + rng.uniform(0.0, 0.4) * rng.normal(size=(3, 3))
        if np.linalg.det(f) < 0.05:
            continue
        a, n = rng.normal(size=(2, 3))
        step = h * np.outer(a, n) / np.linalg.norm(a) / np.linalg.norm(n)
        assert energy(f + step) - 2.0 * energy(f) + energy(f - step) > 0.0


def test_a_bar_that_hardly_changes_its_volume_bears_demirays_stress():
    law, mu, lam = law_of(exponential(B)), 1.0, 1e9
    for stretch in (0.6, 1.7):
        across = lambda t, s=stretch: evaluate(law, [s, t, t], mu, lam)[1][1]  # noqa: E731
        side = brentq(across, 0.99 * stretch**-0.5, 1.01 * stretch**-0.5, xtol=1e-15)
        nominal = evaluate(law, [stretch, side, side], mu, lam)[1][0]
        expected = np.exp(B * (stretch**2 + 2 / stretch - 3)) * (stretch - stretch**-2.0)
        assert nominal == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("stretch", [0.6, 1.7])
def test_a_loaded_cube_finds_the_closed_solution(box, order, stretch):
    """Without Poisson's ratio a cube that is held at one side bears μ exp(b Q) (s − 1/s), and is as wide as before."""
    mesh, material = box([2, 2, 2], [0.1, 0.1, 0.1], 0.2), Material(3000.0, 0.0, 1000.0, exponential(B))
    problem = Equilibrium(nest("cube", mesh, order - 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), material), 0, order)
    rest = problem.mesh.nodes
    nominal = 1500.0 * np.exp(B * (stretch**2 - 1 - 2 * np.log(stretch))) * (stretch - 1 / stretch)
    load = -problem.free_force(rest * [stretch, 1.0, 1.0])  # no load: what holds the sides and the end
    end = rest[:, 0] > 0.1 - 1e-9
    assert load[end].sum(axis=0) == pytest.approx([nominal * 0.01, 0.0, 0.0], rel=1e-9, abs=1e-9)
    found = problem.solve(np.where(end[:, None], load, 0.0), 1e-10).x
    assert found == pytest.approx(rest * [stretch, 1.0, 1.0], abs=1e-9)


def test_methods_with_a_law_of_their_own_refuse(slab):
    """They do not take another law for theirs."""
    body = replace(slab, material=replace(slab.material, law=exponential(8.0)))
    for method in ("xpbd", "vertex_block_descent", "projective_dynamics"):
        with pytest.raises(Refused, match=rf"{method} has the corotational law, and .* is exponential\(8\)"):
            refuse_law(body, method)
    particles = particles_of(body, 0, surface=False)
    elements = LinearElements(particles, particles.tissue)
    with pytest.raises(InputError, match="steps corotational elements or triangles, and the elastic effect is exp"):
        RelaxedParts(System(particles, {"exponential": elements}), "xpbd")
