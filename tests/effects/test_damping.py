"""Damping of Rayleigh and of velocity: the matrix it says, positive semidefinite, and the force that belongs to it."""

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.simple_shapes import sheet
from palpate.effects import linear_elements, triangles
from palpate.effects.rayleigh import make
from palpate.effects.settings import Rayleigh, VelocityDamping
from palpate.effects.velocity_damping import make as make_velocity_damping
from palpate.linalg.block_pattern import shared_pattern

RATE = 3.0


def solid(slab, soft):
    particles = particles_of(slab, 0, False)
    return particles, linear_elements.make(particles, None)


def membrane(slab, soft):
    mesh = sheet([0.2, 0.1], [4, 2], 0.001)
    masses, none = 1.0 * mesh.areas, np.empty((0, 4), dtype=np.int64)
    particles = Particles("cloth", mesh.nodes, masses, np.empty(0, int), mesh.triangles, none, soft, 0.001)
    return particles, triangles.make(particles, None)


@pytest.fixture(scope="module", params=[solid, membrane], ids=["solid", "membrane"])
def case(request, slab, soft):
    """Particles, their elastic effect and crumpled positions, where the exact stiffness is indefinite."""
    particles, elastic = request.param(slab, soft)
    x = particles.nodes + 0.01 * np.random.default_rng(1).normal(size=particles.nodes.shape)
    return particles, elastic, x


def matrix_of(add, couples, particles):
    pattern = shared_pattern([particles.triangles, couples], len(particles.nodes))  # other blocks beside its own
    values = np.zeros((len(pattern.indices), 3, 3))
    add(pattern.slots[1], values)
    return pattern.matrix(values).toarray()


def damping_of(damping, particles, x):
    return matrix_of(lambda *into: damping.add_damping(x, *into), damping.couples, particles)


@pytest.mark.parametrize(("mass", "stiffness"), [(0.5, 0.0), (0.0, 0.02), (0.5, 0.02), ("velocity", 0.0)])
def test_the_matrix_and_its_force(case, mass, stiffness):
    particles, elastic, x = case
    if mass == "velocity":
        mass, damping = RATE, make_velocity_damping(particles, VelocityDamping(rate_1_s=RATE), None)
    else:
        damping = make(particles, Rayleigh(mass_1_s=mass, stiffness_s=stiffness), elastic)
    found = damping_of(damping, particles, x)
    definite = matrix_of(lambda *into: elastic.add_stiffness(x, True, *into), elastic.couples, particles)
    expected = mass * np.diag(np.repeat(particles.masses, 3)) + stiffness * definite
    assert np.abs(found - expected).max() < 1e-13 * np.abs(expected).max()
    assert np.abs(found - found.T).max() < 1e-13 * np.abs(found).max()
    assert np.linalg.eigvalsh(found)[0] > -1e-12 * np.abs(found).max()
    v = np.random.default_rng(2).normal(size=x.shape)
    for _ in range(2):  # nothing is left over from the call before
        force = np.ones_like(v)
        damping.add_force(x, v, force)
        product = (found @ v.ravel()).reshape(v.shape)
        assert np.abs(force - 1.0 + product).max() < 1e-12 * max(1.0, np.abs(product).max())
    assert np.array_equal(damping_of(damping, particles, x), found)


def test_stiffness_leaves_flight_and_rotation_at_rest_alone_and_mass_does_not(case):
    particles, elastic, x = case
    flight = np.tile([1.0, -2.0, 0.5], (len(x), 1))
    for at, v in ((x, flight), (particles.nodes, np.cross([1.0, 2.0, 3.0], particles.nodes))):
        force = np.zeros_like(v)
        make(particles, Rayleigh(mass_1_s=0.0, stiffness_s=1.0), elastic).add_force(at, v, force)
        assert np.abs(force).max() < 1e-11 * particles.material.young_pa * particles.size
    force[:] = 0.0
    make(particles, Rayleigh(mass_1_s=2.0, stiffness_s=0.0), elastic).add_force(x, flight, force)
    assert force.sum(axis=0) == pytest.approx(-2.0 * particles.masses.sum() * flight[0], rel=1e-9)


def test_without_a_stiffness_mass_can_damp(case):
    particles, _, x = case
    damping = make(particles, Rayleigh(mass_1_s=1.0, stiffness_s=0.0), SimpleNamespace())
    found = damping_of(damping, particles, x)
    assert np.abs(found - np.diag(np.repeat(particles.masses, 3))).max() < 1e-15


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, False)


@pytest.fixture(scope="module")
def damping(particles):
    return make_velocity_damping(particles, VelocityDamping(rate_1_s=RATE), None)


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
