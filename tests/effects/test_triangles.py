"""Constant-strain triangles against the plane-stress solution, finite differences and their own symmetries."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.box import sheet
from palpate.bodies.material import Material
from palpate.bodies.mesh import Sheet
from palpate.bodies.particles import particles_of
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
    return found, make(found, {})


@pytest.fixture
def triangle():
    """One triangle, of a sheet that has two."""
    mesh = sheet([0.11, 0.07], [1, 1], 0.002)
    mesh = Sheet(mesh.nodes[mesh.triangles[0]], np.array([[0, 1, 2]]), 0.002)
    found = particles_of(nest("patch", mesh, 0, np.array([0]), Material(1e4, 0.3, 1000.0)), 0, False)
    return found, make(found, {})


def crumpled(nodes, rotation, amount=0.01):
    return nodes @ rotation(2.0).T + amount * np.random.default_rng(3).normal(size=nodes.shape)


def test_turning_costs_nothing(cloth, rotation, force_of):
    sheet, effect = cloth
    for angle in [*np.linspace(0, 2 * np.pi, 9), np.pi - 1e-8, 1e-9]:
        x = sheet.nodes @ rotation(angle).T + [0.3, -0.2, 0.1]
        assert np.abs(force_of(effect, x)).max() < 1e-12 * effect.moduli[0] * sheet.thickness_m * sheet.size * 10
        assert effect.energy(x) < 1e-24 * effect.moduli[0] * sheet.thickness_m * sheet.size**2 * 10


def test_energy_and_force_turn_with_the_sheet(cloth, rotation, force_of):
    sheet, effect = cloth
    x, turn = crumpled(sheet.nodes, rotation), rotation(0.7)
    assert effect.energy(x @ turn.T) == pytest.approx(effect.energy(x), rel=1e-12)
    force = force_of(effect, x)
    assert np.abs(force_of(effect, x @ turn.T) - force @ turn.T).max() < 1e-12 * np.abs(force).max()
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-12 * np.abs(force).sum() * sheet.size


def test_force_and_stiffness_are_derivatives(cloth, rotation, force_of, stiffness_of, differences):
    sheet, effect = cloth
    x = crumpled(sheet.nodes, rotation)
    force, stiffness = force_of(effect, x), stiffness_of(effect, x)
    slope = differences(effect.energy, x, 1e-6 * sheet.size).reshape(x.shape)
    assert np.abs(force + slope).max() < 1e-7 * np.abs(force).max()
    slope = -differences(lambda x: force_of(effect, x), x, 1e-6 * sheet.size)
    assert np.abs(stiffness - slope).max() < 1e-7 * np.abs(stiffness).max()
    assert np.abs(stiffness - stiffness.T).max() < 1e-13 * np.abs(stiffness).max()


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
    effect = make(strip, {})
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


def test_solids_are_refused(beam):
    for surface in (False, True):
        with pytest.raises(InputError, match=r"^beam: effect triangles is for sheets"):
            make(particles_of(beam, 0, surface), {})
