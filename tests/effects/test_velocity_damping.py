"""Velocity damping: one matrix, its force, and the exact decay."""

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects.velocity_damping import make
from palpate.linalg.block_pattern import shared_pattern

RATE = 3.0


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, False)


@pytest.fixture(scope="module")
def damping(particles):
    return make(particles, {"rate_1_s": RATE}, None)


def test_the_matrix_is_rate_times_mass_and_the_force_minus_its_product(particles, damping):
    pattern = shared_pattern([particles.tetrahedra, damping.couples], len(particles.nodes))
    values = np.zeros((len(pattern.indices), 3, 3))
    damping.add_damping(particles.nodes, pattern.slots[1], values)
    matrix = pattern.matrix(values).toarray()
    assert np.array_equal(matrix, np.diag(np.repeat(RATE * particles.masses, 3)))
    v = np.random.default_rng(0).normal(size=particles.nodes.shape)
    force = np.ones_like(v)
    damping.add_force(particles.nodes, v, force)
    assert np.abs(force - 1.0 + (matrix @ v.ravel()).reshape(v.shape)).max() < 1e-15


@pytest.mark.parametrize("h", [1e-3, 1.0, 1e3])
def test_the_projection_decays_exactly_for_any_step(particles, damping, h):
    v = np.random.default_rng(0).normal(size=particles.nodes.shape)
    once, halves = v.copy(), v.copy()
    damping.project(particles.nodes, particles.nodes, once, h)
    damping.project(particles.nodes, particles.nodes, halves, h / 2)
    damping.project(particles.nodes, particles.nodes, halves, h / 2)
    assert once == pytest.approx(v * np.exp(-RATE * h), rel=1e-12)
    assert halves == pytest.approx(once, rel=1e-12)
    # M v' = −C v: the force is the slope of the decay
    force, soon = np.zeros_like(v), v.copy()
    damping.add_force(particles.nodes, v, force)
    damping.project(particles.nodes, particles.nodes, soon, 1e-8)
    assert particles.masses[:, None] * (soon - v) / 1e-8 == pytest.approx(force, rel=1e-6)
