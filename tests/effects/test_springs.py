"""Springs, and what is made like them, against finite differences and the conservation laws."""

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects import body_springs, maxwell, springs, volume_force
from palpate.errors import InputError
from palpate.solvers.system import System

SURFACE = {"structural_n_m": 20.0, "shear_n_m": 10.0, "bending_n_m": 5.0}


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, False)


@pytest.fixture(scope="module")
def systems(slab, particles):
    """One effect each; nothing is held."""
    surface = particles_of(slab, 0, True)
    elastic = springs.make(particles, {})
    relaxed = maxwell.make(particles, {"stiffness_ratio": 0.5, "relaxation_s": 0.1}, elastic)
    relaxed.relax(1.3 * particles.nodes, 0.05)
    made = {
        "springs": (particles, elastic),
        "surface springs": (surface, springs.make(surface, SURFACE)),
        "maxwell": (particles, relaxed),
        "volume": (particles, volume_force.make(particles, {"stiffness_n_m": 10.0}, elastic)),
        "body springs": (
            particles,
            body_springs.make(particles, {"stiffness_n_m": 3.0, "damping_ratio": 0.5}, elastic),
        ),
    }
    return {name: System(moved, {name: effect}) for name, (moved, effect) in made.items()}


NAMES = ("springs", "surface springs", "maxwell", "volume", "body springs")


def crumpled(nodes, rotation, amount):
    return nodes @ rotation(2.0).T + amount * 0.05 * np.random.default_rng(3).normal(size=nodes.shape)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("amount", [0.1, 1.0])
def test_force_and_stiffness_are_derivatives(systems, rotation, name, amount):
    system = systems[name]
    x = crumpled(system.particles.nodes, rotation, amount)
    force, stiffness, still = system.force(x, 0 * x), system.stiffness(x, False).toarray(), np.zeros_like(x)
    step = 1e-6 * system.particles.size
    for i in range(x.size):
        delta = np.zeros(x.size)
        delta[i] = step
        delta = delta.reshape(x.shape)
        slope = (system.energy(x + delta) - system.energy(x - delta)) / (2 * step)
        assert abs(force.flat[i] + slope) < 1e-7 * np.abs(force).max()
        slope = (system.force(x - delta, still) - system.force(x + delta, still)).ravel() / (2 * step)
        assert np.abs(stiffness[i] - slope).max() < 1e-6 * np.abs(stiffness).max()
    assert np.abs(stiffness - stiffness.T).max() < 1e-14 * np.abs(stiffness).max()


@pytest.mark.parametrize("name", NAMES)
def test_definite_stiffness_only_adds_what_makes_it_so(systems, rotation, name):
    """Exact minus definite is the clamped, negative part; a stretched body has none."""
    system = systems[name]
    x = 0.4 * crumpled(system.particles.nodes, rotation, 0.2)
    exact, definite = (system.stiffness(x, d).toarray() for d in (False, True))
    assert np.linalg.eigvalsh(definite)[0] > -1e-12 * np.abs(definite).max()
    assert np.linalg.eigvalsh(definite - exact)[0] > -1e-12 * np.abs(exact).max()
    assert (np.linalg.eigvalsh(exact)[0] < -0.1) == (name != "body springs")
    stretched = 1.5 * system.particles.nodes
    assert np.array_equal(system.stiffness(stretched, False).data, system.stiffness(stretched, True).data)


@pytest.mark.parametrize("name", ["springs", "surface springs", "maxwell", "volume"])
def test_forces_and_moments_balance(systems, rotation, name):
    system = systems[name]
    x = crumpled(system.particles.nodes, rotation, 0.5)
    force = system.force(x, 0 * x)
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * np.abs(force).sum()
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-13 * np.abs(force).sum() * system.particles.size


@pytest.mark.parametrize("name", ["springs", "surface springs", "volume"])
def test_turning_costs_nothing_and_stretching_is_resisted(systems, rotation, name):
    system = systems[name]
    nodes = system.particles.nodes
    turned = nodes @ rotation(1.0).T + [0.1, 0.2, 0.3]
    assert np.abs(system.force(turned, 0 * nodes)).max() < 1e-10
    for factor in (0.8, 1.2):
        x = factor * nodes
        back = system.force(x, 0 * nodes)
        assert np.vdot(back, x - x.mean(axis=0)) * (factor - 1.0) < 0.0


@pytest.mark.parametrize("name", NAMES)
def test_collapsed_bodies_stay_finite(systems, name):
    """All nodes at one point, on a line, at distances that underflow when squared."""
    system = systems[name]
    nodes = system.particles.nodes
    for x in (0 * nodes, nodes * [1.0, 0.0, 0.0], 1e-170 * nodes, 1e-160 * nodes):
        assert np.isfinite(system.energy(x))
        assert np.isfinite(system.force(x, 0 * x)).all()
        for definite in (False, True):
            assert np.isfinite(system.stiffness(x, definite).data).all()
        assert np.linalg.eigvalsh(system.stiffness(x, True).toarray())[0] > -1e-9


def test_a_surface_says_what_stiffness_it_lacks(slab):
    surface = particles_of(slab, 0, True)
    with pytest.raises(InputError, match=r"springs\.bending_n_m of slab is missing"):
        springs.make(surface, {"structural_n_m": 1.0, "shear_n_m": 1.0})
    with pytest.raises(InputError, match="have no stiffness"):
        springs.make(surface, dict.fromkeys(SURFACE, 0.0))
    only = springs.make(surface, {"structural_n_m": 1.0, "shear_n_m": 0.0, "bending_n_m": 0.0})
    assert 2 * len(only.pairs) == 3 * len(surface.triangles)


def test_volume_needs_tetrahedra(slab):
    with pytest.raises(InputError, match="volume, which needs tetrahedra"):
        volume_force.make(particles_of(slab, 0, True), {"stiffness_n_m": 1.0}, None)
