"""Quadratic bending against the energy of plates rolled onto cylinders."""

from itertools import pairwise

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.box import sheet
from palpate.bodies.material import Material
from palpate.bodies.mesh import Sheet
from palpate.bodies.particles import merge_particles, particles_of
from palpate.effects.bending import hinges, make
from palpate.errors import InputError

LENGTH, WIDTH, THICKNESS, CURVATURE = 0.3, 0.2, 0.002, 4.0
STIFFNESS = 1e5 * THICKNESS**3 / (12 * (1 - 0.3**2))
PLATE = 0.5 * STIFFNESS * CURVATURE**2 * LENGTH * WIDTH


def plate(divisions=(6, 4), nodes=None):
    mesh = sheet([LENGTH, WIDTH], list(divisions), THICKNESS)
    mesh = mesh if nodes is None else Sheet(nodes(mesh.nodes), mesh.triangles, THICKNESS)
    return particles_of(nest("plate", mesh, 0, np.array([0]), Material(1e5, 0.3, 1000.0)), 0, False)


def rolled(nodes, angle):
    """The plate rolled, without stretch, onto a cylinder whose axis is at ``angle`` to y."""
    along, across = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
    arc = CURVATURE * (nodes @ along)
    up = (1 - np.cos(arc)) / CURVATURE
    return np.outer(np.sin(arc) / CURVATURE, along) + np.outer(nodes @ across, across) + np.outer(up, [0, 0, 1])


def test_sheets_that_are_flat_each_by_itself():
    tilted = plate(nodes=lambda nodes: nodes @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0])
    pair = merge_particles([plate(), tilted], [[0, 0, 0], [0, 0, 0.5]], "pair")
    effect, x = make(pair, {}), pair.nodes.copy()
    n = len(plate().nodes)
    x[:n] = rolled(plate().nodes, 0.3)
    assert effect.energy(x) == pytest.approx(make(plate(), {}).energy(x[:n]), rel=1e-9)
    with pytest.raises(InputError, match="flat at rest"):
        make(
            merge_particles([plate(), plate(nodes=lambda nodes: rolled(nodes, 0.3))], [[0, 0, 0], [0, 0, 0.5]], "pair"),
            {},
        )


@pytest.mark.parametrize(("angle", "along", "across"), [(0.0, 24, 16), (np.pi / 2, 16, 24)])
def test_a_plate_rolled_along_a_side(angle, along, across):
    """½ D κ² A, less the two rims of half a cell that have no hinge, and (κ h)²/12 for the chords."""
    effect, x = make(plate((24, 16)), {}), rolled(plate((24, 16)).nodes, angle)
    step = CURVATURE * LENGTH / 24
    chords = 2 * (1 - np.cos(step)) / step**2
    assert effect.energy(x) == pytest.approx(PLATE * (1 - 1 / along) * chords**2, rel=1e-10)


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4, 1.2, np.pi / 2])
def test_energy_converges_to_the_plates_in_every_direction(angle):
    """The error, of the rims, is of first order; without it, by Richardson's extrapolation, of second."""
    found = []
    for cells in (6, 12, 24):
        particles = plate((3 * cells // 2, cells))
        found.append(make(particles, {}).energy(rolled(particles.nodes, angle)) / PLATE)
    first, second = (2 * fine - coarse for coarse, fine in pairwise(found))
    assert 1.8 < (found[1] - 1) / (found[2] - 1) < 2.2
    assert abs(second - 1) < 0.003
    assert abs(first - 1) > 3 * abs(second - 1)


def test_twist_costs_what_a_plate_pays():
    """½ D ∫ ‖∇²w‖² for w = c x y: twice c² (not free, as in energies of the mean curvature)."""
    particles = plate((6, 4))
    x = particles.nodes.copy()
    x[:, 2] = 0.1 * x[:, 0] * x[:, 1]
    expected = 0.5 * STIFFNESS * 2 * 0.1**2 * LENGTH * WIDTH
    assert make(particles, {}).energy(x) == pytest.approx(expected, rel=1e-10)


def test_rigid_motion_and_stretch_cost_nothing(rotation, force_of):
    particles = plate()
    effect, bent = make(particles, {}), rolled(particles.nodes, 0.4)
    scale = np.abs(force_of(effect, bent)).max()
    for x in (particles.nodes + 1e3, particles.nodes @ rotation(2.0).T, particles.nodes * [1.3, 0.8, 1.0]):
        assert effect.energy(x) < 1e-18 * PLATE
        assert np.abs(force_of(effect, x)).max() < 1e-9 * scale


def test_momentum_is_kept(rotation, force_of):
    particles = plate()
    effect = make(particles, {})
    x = rolled(particles.nodes, 0.4) @ rotation(1.0).T + 0.01 * np.random.default_rng(0).normal(size=(35, 3))
    force = force_of(effect, x)
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-12 * np.abs(force).sum() * particles.size


def test_force_and_stiffness_are_derivatives(force_of, stiffness_of):
    """Exactly: the energy is ½ xᵀ Q x, and Q is positive semidefinite."""
    particles = plate((3, 2))
    effect = make(particles, {})
    x = rolled(particles.nodes, 0.4) + 0.01 * np.random.default_rng(0).normal(size=(12, 3))
    stiffness = stiffness_of(effect, x, definite=True)
    assert effect.energy(x) == pytest.approx(0.5 * x.ravel() @ stiffness @ x.ravel(), rel=1e-10)
    force = force_of(effect, x).ravel()
    assert np.abs(force + stiffness @ x.ravel()).max() < 1e-11 * np.abs(force).max()
    values = np.linalg.eigvalsh(stiffness)
    assert values[0] > -1e-13 * values[-1]
    # affine deformations, and nothing else, are free: 3 functions for each of 3 coordinates
    assert (values < 1e-9 * values[-1]).sum() == 9


def test_every_inner_edge_is_a_hinge():
    particles = plate()
    found = hinges(particles.triangles)
    rims = 2 * (6 + 4)
    edges = (3 * len(particles.triangles) + rims) // 2
    assert found.shape == (edges - rims, 4)
    triangles = {tuple(t) for t in np.sort(particles.triangles, axis=1).tolist()}
    for a, b, c, d in found.tolist():
        assert {tuple(sorted((a, b, c))), tuple(sorted((a, b, d)))} <= triangles


def test_what_is_not_a_flat_sheet_is_refused(beam, rotation):
    with pytest.raises(InputError, match=r"^beam: effect bending is for sheets"):
        make(particles_of(beam, 0, True), {})
    with pytest.raises(InputError, match=r"^plate: effect bending needs a sheet that is flat at rest"):
        make(plate(nodes=lambda nodes: rolled(nodes, 0.0)), {})
    turned = make(plate(nodes=lambda nodes: nodes @ rotation(1.0).T), {})
    assert turned.energy(rolled(plate().nodes, 0.0)) == pytest.approx(
        make(plate(), {}).energy(rolled(plate().nodes, 0.0)), rel=1e-10
    )
