"""Contact with spheres and floors: derivatives, depth, and what it leaves alone."""

from functools import partial

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects.contact import make

STIFFNESS = 40.0
SPHERE = {"kind": "sphere", "center_m": [0.1, 0.05, 0.1], "radius_m": 0.06}
FLOOR = {"kind": "floor", "axis": "z", "height_m": 0.01}


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, False)


@pytest.fixture(scope="module")
def contact(particles):
    return make(particles, {"stiffness_n_m": STIFFNESS, "instruments": [SPHERE, FLOOR]}, None)


def test_force_and_stiffness_are_the_derivatives(particles, contact, force_of, stiffness_of, differences):
    x = particles.nodes + 0.01 * np.random.default_rng(0).normal(size=particles.nodes.shape)
    force = force_of(contact, x)
    inside = np.linalg.norm(x - SPHERE["center_m"], axis=1) < SPHERE["radius_m"]
    assert inside.sum() >= 4 and (x[:, 2] < FLOOR["height_m"]).sum() >= 4
    assert np.array_equal(force.any(axis=1), inside | (x[:, 2] < FLOOR["height_m"]))
    slope = differences(contact.energy, x, 1e-6).reshape(x.shape)
    assert np.abs(force + slope).max() < 1e-8 * np.abs(force).max()
    stiffness = stiffness_of(contact, x, False)
    slope = -differences(partial(force_of, contact), x, 1e-7)
    assert np.abs(stiffness - slope).max() < 1e-6 * np.abs(stiffness).max()


def test_the_definite_stiffness_drops_exactly_the_negative_part(particles, contact, stiffness_of):
    x = particles.nodes + 0.01 * np.random.default_rng(0).normal(size=particles.nodes.shape)
    alone = make(particles, {"stiffness_n_m": STIFFNESS, "instruments": [SPHERE]}, None)
    values, vectors = np.linalg.eigh(stiffness_of(alone, x, False))
    assert values[0] < -0.1 * STIFFNESS
    clamped = vectors @ np.diag(np.maximum(values, 0.0)) @ vectors.T
    assert np.abs(stiffness_of(alone, x, True) - clamped).max() < 1e-12 * STIFFNESS
    assert np.linalg.eigvalsh(stiffness_of(contact, x, True))[0] > -1e-12 * STIFFNESS


def test_the_force_grows_with_depth_and_points_out(particles, contact, force_of):
    x = np.tile([5.0, 5.0, 5.0], (len(particles.nodes), 1))  # clear of everything
    assert contact.energy(x) == 0.0 and not force_of(contact, x).any()
    x[0] = [3.0, 3.0, -0.02]
    x[1] = np.add(SPHERE["center_m"], [0.05, 0.0, 0.0])
    force = force_of(contact, x)
    assert force[0] == pytest.approx([0.0, 0.0, 0.03 * STIFFNESS], rel=1e-12)
    assert force[1] == pytest.approx([0.01 * STIFFNESS, 0.0, 0.0], rel=1e-12, abs=1e-15)
    assert contact.energy(x) == pytest.approx(0.5 * STIFFNESS * (0.03**2 + 0.01**2), rel=1e-12)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_floors_face_along_their_axis(particles, axis, force_of):
    floor = {"kind": "floor", "axis": axis, "height_m": 10.0}
    force = force_of(make(particles, {"stiffness_n_m": 1.0, "instruments": [floor]}, None), particles.nodes)
    expected = np.zeros_like(force)
    expected[:, "xyz".index(axis)] = 10.0 - particles.nodes[:, "xyz".index(axis)]
    assert force == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("away", [0.0, 1e-300, 1e-14])
def test_the_centre_of_a_sphere_is_safe(particles, away, force_of, stiffness_of):
    alone = make(particles, {"stiffness_n_m": STIFFNESS, "instruments": [SPHERE]}, None)
    x = np.tile(np.add(SPHERE["center_m"], [away, 0.0, 0.0]), (len(particles.nodes), 1))
    force = force_of(alone, x)
    assert np.linalg.norm(force, axis=1) == pytest.approx(STIFFNESS * SPHERE["radius_m"], rel=1e-12)
    for definite in (False, True):
        assert np.isfinite(stiffness_of(alone, x, definite)).all()
