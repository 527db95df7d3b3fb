"""Constant-strain triangles against the plane-stress solution, finite differences and their own symmetries."""

from itertools import pairwise

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.mesh import Sheet
from palpate.bodies.particles import merge_particles, particles_of
from palpate.bodies.simple_shapes import sheet
from palpate.effects.bending import hinges
from palpate.effects.bending import make as make_bending
from palpate.effects.triangles import FOLD, make
from palpate.errors import InputError

# singular values of F; below FOLD the energy's peak is rounded off
STRETCHES = {
    "rest": [1, 1],
    "stretched": [1.5, 1.2],
    "crushed": [0.4, 0.3],
    "narrow": [1.3, FOLD / 3],
    "edge of the fold": [1.3, FOLD],
    "line": [1.3, 0],
    "small": [FOLD / 2, FOLD / 3],
    "speck": [FOLD / 2, FOLD / 2],
    "point": [0, 0],
}


def particles(sizes, divisions, poisson=0.3, jitter=0.0):
    """A sheet 2 mm thick, whose inner nodes are moved within it by up to that part of a cell."""
    mesh = sheet(sizes, divisions, 0.002)
    inner = (mesh.nodes[:, :2] > 0).all(axis=1) & (mesh.nodes[:, :2] < np.array(sizes) * 0.999).all(axis=1)
    moves = np.random.default_rng(0).uniform(-jitter, jitter, (inner.sum(), 2))
    mesh.nodes[inner, :2] += moves * np.array(sizes) / divisions
    return particles_of(nest("cloth", mesh, 0, np.array([0]), Material(1e4, poisson, 1000.0)), 0, False)


@pytest.fixture(params=[-0.5, 0.0, 0.3, 0.49])
def cloth(request):
    found = particles([0.3, 0.2], [3, 2], request.param, jitter=0.25)
    return found, make(found, None)


@pytest.fixture
def triangle():
    """One triangle, of a sheet that has two."""
    mesh = sheet([0.11, 0.07], [1, 1], 0.002)
    mesh = Sheet(mesh.nodes[mesh.triangles[0]], np.array([[0, 1, 2]]), 0.002)
    found = particles_of(nest("patch", mesh, 0, np.array([0]), Material(1e4, 0.3, 1000.0)), 0, False)
    return found, make(found, None)


def crumpled(nodes, rotation, amount=0.01):
    return nodes @ rotation(2.0).T + amount * np.random.default_rng(3).normal(size=nodes.shape)


def test_force_and_stiffness_are_derivatives_and_turn_with_the_sheet(cloth, rotation, check_derivatives, check_frame):
    sheet, effect = cloth
    x = crumpled(sheet.nodes, rotation)
    check_frame(effect, x, sheet.size)
    check_derivatives(effect, x, 1e-6 * sheet.size, stiffness_error=1e-7)


@pytest.mark.parametrize("name", STRETCHES)
def test_collapsed_triangles(name, triangle, rotation, force_of, stiffness_of, differences):
    """Derivatives are right, nothing is NaN, and the definite stiffness drops exactly the negative part."""
    patch, effect = triangle
    plane = np.array([[0.6, -0.8], [0.8, 0.6]])
    x = patch.nodes[:, :2] @ (rotation(1.0)[:, :2] @ np.diag(STRETCHES[name]) @ plane).T
    stiffness, definite = stiffness_of(effect, x), stiffness_of(effect, x, definite=True)
    scale = effect.moduli[0] * patch.thickness_m
    slope = differences(effect.energy, x, 1e-6).reshape(x.shape)
    assert np.abs(force_of(effect, x) + slope).max() < 1e-6 * scale * patch.size
    slope = -differences(lambda x: force_of(effect, x), x, 1e-7)
    # third derivatives jump at the edge of the fold
    assert np.abs(stiffness - slope).max() < (1e-3 if name == "edge of the fold" else 1e-5) * np.abs(stiffness).max()

    to_f = np.einsum("aj,ik->ijak", effect.gradients[0], np.eye(3)).reshape(6, 9)
    back = np.linalg.pinv(to_f)
    values, vectors = np.linalg.eigh(back.T @ stiffness @ back)
    assert (values[0] < -1e-6 * scale * patch.size**2) == (name not in ("rest", "stretched"))
    expected = to_f.T @ vectors @ np.diag(np.maximum(values, 0.0)) @ vectors.T @ to_f
    assert np.abs(definite - expected).max() < 1e-9 * np.abs(stiffness).max()


def test_a_collapsed_triangle_far_from_the_fold_is_the_plain_energy(triangle):
    """μ Σ (σ − 1)² + λₚ/2 (σ₁ + σ₂ − 2)², with numpy's singular values."""
    patch, effect = triangle
    mu, lam = effect.moduli
    x = patch.nodes + 0.02 * np.random.default_rng(1).normal(size=patch.nodes.shape)
    s = np.linalg.svd(np.einsum("ai,aj->ij", x[effect.couples[0]], effect.gradients[0]), compute_uv=False)
    density = mu * ((s - 1) ** 2).sum() + 0.5 * lam * (s.sum() - 2) ** 2
    assert effect.energy(x) == pytest.approx(effect.volumes[0] * density, rel=1e-13)


@pytest.mark.parametrize("strain", [1e-6, 0.3])
def test_tension_gives_youngs_modulus_and_poissons_ratio(cloth, strain, force_of):
    """Stretched by e and narrowed by ν e, only the ends carry force: E e t times the width, in plane stress."""
    sheet, effect = cloth
    young, poisson = sheet.material.young_pa, sheet.material.poisson
    force = force_of(effect, sheet.nodes * [1 + strain, 1 - poisson * strain, 1])
    expected = young * strain * sheet.thickness_m * 0.2
    right = sheet.nodes[:, 0] > 0.299
    left = sheet.nodes[:, 0] == 0.0
    assert -force[right, 0].sum() == pytest.approx(expected, rel=1e-9)
    assert np.abs(force[~right & ~left]).max() < 1e-9 * expected
    assert np.abs(force[:, 1:]).max() < 1e-9 * expected


def test_patch(cloth, rotation, force_of):
    """Of any linear deformation the inner nodes feel nothing."""
    sheet, effect = cloth
    x = sheet.nodes @ (rotation(1.0) @ np.array([[1.2, 0.3, 0], [-0.1, 0.8, 0], [0.2, 0.1, 1]])).T
    force = force_of(effect, x)
    inner = (
        (sheet.nodes[:, 0] > 0) & (sheet.nodes[:, 0] < 0.299) & (sheet.nodes[:, 1] > 0) & (sheet.nodes[:, 1] < 0.199)
    )
    assert inner.any()
    assert np.abs(force[inner]).max() < 1e-13 * np.abs(force).max()


@pytest.mark.parametrize(("poisson", "tolerance"), [(0.0, 1e-4), (0.3, 0.01)])
def test_a_hanging_strip_stretches_by_its_weight(poisson, tolerance, force_of, stiffness_of):
    """ρ g L² / (2 E): the law is linear in the stretch, so at any strain; the held end does not narrow."""
    strip = particles([1.0, 0.05], [40, 2], poisson)
    effect = make(strip, None)
    free = np.zeros(strip.nodes.shape, dtype=bool)
    free[strip.nodes[:, 0] > 0, :2] = True
    free = free.ravel()
    weight = np.outer(strip.masses, [9.81, 0, 0])
    x = strip.nodes.copy()
    for _ in range(2):
        residual = (force_of(effect, x) + weight).ravel()[free]
        x.ravel()[free] += np.linalg.solve(stiffness_of(effect, x)[np.ix_(free, free)], residual)
    end = strip.nodes[:, 0] == 1.0
    assert (x - strip.nodes)[end, 0].mean() == pytest.approx(1000 * 9.81 / (2 * 1e4), rel=tolerance)


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
    effect, x = make_bending(pair, None), pair.nodes.copy()
    n = len(plate().nodes)
    x[:n] = rolled(plate().nodes, 0.3)
    assert effect.energy(x) == pytest.approx(make_bending(plate(), None).energy(x[:n]), rel=1e-9)


@pytest.mark.parametrize(("angle", "along", "across"), [(0.0, 24, 16), (np.pi / 2, 16, 24)])
def test_a_plate_rolled_along_a_side(angle, along, across):
    """½ D κ² A, less the two rims of half a cell that have no hinge, and (κ h)²/12 for the chords."""
    effect, x = make_bending(plate((24, 16)), None), rolled(plate((24, 16)).nodes, angle)
    step = CURVATURE * LENGTH / 24
    chords = 2 * (1 - np.cos(step)) / step**2
    assert effect.energy(x) == pytest.approx(PLATE * (1 - 1 / along) * chords**2, rel=1e-10)


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4, 1.2, np.pi / 2])
def test_energy_converges_to_the_plates_in_every_direction(angle):
    """The error, of the rims, is of first order; without it, by Richardson's extrapolation, of second."""
    found = []
    for cells in (6, 12, 24):
        particles = plate((3 * cells // 2, cells))
        found.append(make_bending(particles, None).energy(rolled(particles.nodes, angle)) / PLATE)
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
    assert make_bending(particles, None).energy(x) == pytest.approx(expected, rel=1e-10)


def test_momentum_is_kept(rotation, check_frame):
    particles = plate()
    x = rolled(particles.nodes, 0.4) @ rotation(1.0).T + 0.01 * np.random.default_rng(0).normal(size=(35, 3))
    check_frame(make_bending(particles, None), x, particles.size, error=1e-10)


def test_force_and_stiffness_are_derivatives_of_bending(force_of, stiffness_of):
    """Exactly: the energy is ½ xᵀ Q x, and Q is positive semidefinite."""
    particles = plate((3, 2))
    effect = make_bending(particles, None)
    assert effect.energy(particles.nodes + 1e3) < 1e-18 * PLATE  # no cancellation far from the origin
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


def test_what_is_not_flat_is_refused():
    bent = plate(nodes=lambda nodes: rolled(nodes, 0.3))
    for sheets in (bent, merge_particles([plate(), bent], [[0, 0, 0], [0, 0, 0.5]], "plate")):
        with pytest.raises(InputError, match=r"^plate: effect bending needs a sheet that is flat at rest"):
            make_bending(sheets, None)
