"""Kelvin dampers: their matrix, and what critical damping means."""

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects import body_springs, kelvin, maxwell, springs
from palpate.effects.springs import Springs
from palpate.errors import InputError
from palpate.solvers.system import System


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, False)


@pytest.mark.parametrize("name", ["kelvin", "body_springs"])
def test_force_is_minus_the_matrix_times_velocity(particles, rotation, name):
    elastic = springs.make(particles, {})
    damper = (
        kelvin.make(particles, {"ratio": 0.3}, elastic)
        if name == "kelvin"
        else body_springs.make(particles, {"stiffness_n_m": 3.0, "damping_ratio": 0.3}, elastic)
    )
    system = System(particles, {name: damper})
    random = np.random.default_rng(1)
    x = particles.nodes @ rotation(1.0).T + 0.02 * random.normal(size=particles.nodes.shape)
    v, matrix = random.normal(size=x.shape), system.damping(x).toarray()
    slowed = system.force(x, v) - system.force(x, 0 * v)
    assert np.abs(slowed.ravel() + matrix @ v.ravel()).max() < 1e-12 * np.abs(slowed).max()
    assert np.abs(matrix - matrix.T).max() < 1e-14 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(matrix)[0] > -1e-12 * np.abs(matrix).max()


def test_turning_is_not_damped(particles):
    system = System(particles, {"kelvin": kelvin.make(particles, {"ratio": 1.0}, springs.make(particles, {}))})
    v = np.cross([1.0, 2.0, -1.0], particles.nodes) + np.array([0.3, 0.1, 0.2])
    assert np.abs(system.force(particles.nodes, v)).max() < 1e-12


def test_coincident_ends_are_not_damped(particles):
    system = System(particles, {"kelvin": kelvin.make(particles, {"ratio": 1.0}, springs.make(particles, {}))})
    nothing = np.zeros_like(particles.nodes)
    assert np.array_equal(system.force(nothing, particles.nodes), nothing)
    assert not system.damping(nothing).data.any()


def test_ratio_1_is_critical_damping():
    """μ² = 4 k m of the pair's reduced mass: the roots of z² + μ/m z + k/m coincide."""
    pair = Springs(np.array([[0, 1]]), np.array([7.0]), np.array([0.1]))
    damper = kelvin.Kelvin(pair, np.array([0.2, 0.3]), 1.0)
    assert damper.damping[0] ** 2 == pytest.approx(4 * 7.0 * (0.2 * 0.3 / 0.5), rel=1e-14)


@pytest.mark.parametrize("effect", [kelvin, maxwell])
def test_only_beside_springs(particles, effect):
    settings = {"ratio": 0.1, "stiffness_ratio": 0.5, "relaxation_s": 0.1}
    with pytest.raises(InputError, match="is not springs"):
        effect.make(particles, settings, object())
