"""Gravity: the whole weight, and an energy that it is the gradient of."""

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects.gravity import make

ACCELERATION = [1.0, -2.0, -9.81]


@pytest.mark.parametrize("surface", [False, True])
def test_the_whole_weight_and_its_work(slab, surface):
    particles = particles_of(slab, 0, surface)
    gravity = make(particles, {"acceleration_m_s2": ACCELERATION}, None)
    force = np.ones_like(particles.nodes)  # it adds
    gravity.add_force(particles.nodes, np.zeros_like(force), force)
    weight = 1000.0 * slab.coarse.volumes.sum() * np.array(ACCELERATION)
    assert (force - 1.0).sum(axis=0) == pytest.approx(weight, rel=1e-12)
    assert gravity.energy(particles.nodes) == 0.0
    # linear in x, so that any displacement shows the gradient
    away = np.random.default_rng(0).normal(size=force.shape)
    assert gravity.energy(particles.nodes + away) == pytest.approx(-np.vdot(force - 1.0, away), rel=1e-12)
    assert gravity.energy(particles.nodes + np.array([0, 0, 2.0])) == pytest.approx(-2.0 * weight[2], rel=1e-12)
