"""Maxwell elements forget: their stress decays with the relaxation time, and takes energy out."""

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects import maxwell, springs


@pytest.fixture
def element(slab):
    particles = particles_of(slab, 0, False)
    elastic = springs.make(particles, {})
    return particles, elastic, maxwell.make(particles, {"stiffness_ratio": 0.5, "relaxation_s": 0.2}, elastic)


def test_stress_under_a_held_stretch_decays_as_exp(element):
    particles, elastic, maxwell_springs = element
    x = 1.1 * particles.nodes
    first = maxwell_springs.energy(x)
    assert first == pytest.approx(0.5 * elastic.energy(x), rel=1e-14)
    for step in range(1, 41):  # whatever the step: the decay is exact
        maxwell_springs.relax(x, 0.01)
        assert maxwell_springs.energy(x) == pytest.approx(first * np.exp(-2 * 0.01 * step / 0.2), rel=1e-10)


def test_no_step_makes_energy_and_long_ones_forget_all(element, rotation):
    particles, _, maxwell_springs = element
    random = np.random.default_rng(2)
    for h in (1e-6, 1e-2, 1.0, 1e6):
        x = particles.nodes + 0.05 * random.normal(size=particles.nodes.shape)
        before = maxwell_springs.energy(x)
        maxwell_springs.relax(x, h)
        assert 0.0 <= maxwell_springs.energy(x) < before
    assert maxwell_springs.energy(x) < 1e-25


def test_the_elastic_springs_keep_their_rest_lengths(element):
    particles, elastic, maxwell_springs = element
    rest = elastic.rest_m.copy()
    maxwell_springs.relax(2.0 * particles.nodes, 1.0)
    assert np.array_equal(elastic.rest_m, rest)
