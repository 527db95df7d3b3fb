"""Virtual body springs bring every node back, damped as asked."""

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects import body_springs


def test_a_node_returns_as_a_damped_oscillator(slab):
    """Against x'' = −ω² x − 2 ratio ω x', whatever the node's mass, over half a period."""
    from palpate.solvers.symplectic_euler import SymplecticEuler
    from palpate.solvers.system import System

    particles, k, ratio = particles_of(slab, 0, False), 5.0, 0.3
    tie = body_springs.make(particles, {"stiffness_n_m": k, "damping_ratio": ratio}, None)
    integrator = SymplecticEuler(System(particles, {"body_springs": tie}))
    start = 0.01 * np.random.default_rng(0).normal(size=particles.nodes.shape)
    x, v = particles.nodes + start, 0 * start
    frequency = np.sqrt(k / particles.masses)[:, None]
    h, steps = float(1e-4 / frequency.max()), 30000
    for _ in range(steps):
        x, v = integrator.step(x, v, h)
    decay, swing = ratio * frequency * h * steps, np.sqrt(1 - ratio**2) * frequency * h * steps
    expected = start * np.exp(-decay) * (np.cos(swing) + ratio / np.sqrt(1 - ratio**2) * np.sin(swing))
    assert np.abs(x - particles.nodes - expected).max() < 3e-4 * np.abs(start).max()


def test_rest_is_where_nothing_pulls(slab):
    particles = particles_of(slab, 0, True)
    tie = body_springs.make(particles, {"stiffness_n_m": 5.0, "damping_ratio": 0.5}, None)
    force = np.zeros_like(particles.nodes)
    tie.add_force(particles.nodes, force.copy(), force)
    assert not force.any()
    assert tie.energy(particles.nodes) == 0.0
    assert tie.energy(particles.nodes + np.array([0.01, 0, 0])) == pytest.approx(
        0.5 * 5.0 * 1e-4 * len(particles.nodes)
    )
