"""Loads: the whole force arrives, on every level with the same virtual work."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.cylinder import cylinder
from palpate.effects.patch_load import nodal_load

FORCE = np.array([0.3, -1.2, 0.5])


@pytest.fixture(scope="module")
def body(soft):
    """The cylinder with layers that grow thicker along it, so that nodes differ in area."""
    mesh = cylinder(0.2, 0.03)
    mesh.nodes[:, 2] = 0.2 * (mesh.nodes[:, 2] / 0.2) ** 1.3
    return nest("beam", mesh, 2, np.arange(19), soft)


@pytest.fixture(scope="module")
def contact(body):
    """In the middle of the side."""
    return int(np.argmin(np.linalg.norm(body.coarse.nodes - [0.03, 0.0, 0.1], axis=1)))


@pytest.mark.parametrize("radius", [0.0, 0.004, 0.02, 0.05])
def test_the_whole_force_arrives_on_every_level(body, contact, radius):
    for level in range(3):
        load = nodal_load(body, level, contact, FORCE, radius)
        assert load.shape == body.levels[level].nodes.shape
        assert load.sum(axis=0) == pytest.approx(FORCE, rel=1e-12)


@pytest.mark.parametrize("radius", [0.0, 0.02])
def test_levels_do_the_same_work_on_a_coarse_displacement(body, contact, radius):
    displacement = np.random.default_rng(0).normal(size=body.coarse.nodes.shape)
    work = np.vdot(nodal_load(body, 0, contact, FORCE, radius), displacement)
    for level, prolongation in enumerate(body.prolongations, start=1):
        displacement = prolongation @ displacement
        assert np.vdot(nodal_load(body, level, contact, FORCE, radius), displacement) == pytest.approx(work, rel=1e-12)


def test_no_radius_and_one_below_the_spacing_load_the_node_alone(body, contact):
    for radius in (0.0, 0.001):
        for level in range(3):
            load = nodal_load(body, level, contact, FORCE, radius)
            assert np.array_equal(np.flatnonzero(load.any(axis=1)), [contact])
            assert np.array_equal(load[contact], FORCE)


def test_a_disc_loads_the_near_side_within_its_radius(body, contact):
    """The shape: 1 − (d/r)² times area, on nodes that face the contact's way."""
    radius, mesh = 0.05, body.fine
    load = nodal_load(body, 2, contact, FORCE, radius)
    assert np.abs(np.cross(load, FORCE)).max() < 1e-15
    share = load @ FORCE / (FORCE @ FORCE)
    distance = np.linalg.norm(mesh.nodes - mesh.nodes[contact], axis=1)
    facing = mesh.normals @ mesh.normals[contact] > 0.0
    loaded = share > 0.0
    assert np.array_equal(loaded, (distance < radius) & facing & (mesh.areas > 0.0))
    assert (distance[~facing] < radius).any() and mesh.nodes[loaded][:, 0].min() > -1e-12
    profile = share[loaded] / mesh.areas[loaded] / (1.0 - (distance[loaded] / radius) ** 2)
    assert profile == pytest.approx(profile[0], rel=1e-10)
    # ∫ 1 − (d/r)² over a flat disc is π r²/2
    small = nodal_load(body, 2, contact, FORCE, 0.02)
    near = small @ FORCE / (FORCE @ FORCE)
    assert near.max() / mesh.areas[near.argmax()] == pytest.approx(2 / (np.pi * 0.02**2), rel=0.15)
