"""Strain, energy, force and stiffness of viscous stress: against matrix functions, and against each other."""

import numpy as np
import pytest
from scipy.linalg import sqrtm

from palpate.bodies.mesh import TetMesh
from palpate.bodies.prony_series import Series
from palpate.effects.linear_elements import LinearElements
from palpate.effects.prony import SLOPE, WIDTH, Prony

TETRAHEDRON = TetMesh(np.array([[0.0, 0, 0], [1.1, 0.1, 0], [0.2, 0.9, 0.1], [0, 0.2, 1.3]]), np.array([[0, 1, 2, 3]]))
STRETCHES = [[1, 1, 1], [1 + 1e-7, 1, 1], [1.3, 1.0, 0.7], [2.0, 2.0, 0.5], [1.5, 0.9, 0.0], [1.2, 1.0, -0.8]]
STRETCHES += [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [100.0, 1.0, 0.001], [1e4, 1e4, 1e4]]
H = 0.05


def made(mesh, soft, shares=(0.3, 0.2), times=(0.1, 1.0)):
    return Prony(LinearElements(mesh, soft), Series(list(shares), list(times)))


def strained(mesh, soft, x):
    """An effect in the middle of a step, whose branches have strains of their own."""
    prony, random = made(mesh, soft), np.random.default_rng(3)
    prony.inner = 0.1 * random.normal(size=prony.inner.shape)
    prony.inner[..., :3] -= prony.inner[..., :3].mean(axis=-1, keepdims=True)
    prony.begin(x, H)
    return prony


@pytest.fixture(scope="module")
def crumpled(box):
    """A block and positions: turned, squeezed and crumpled, some elements inverted."""
    mesh = box([2, 2, 2], [0.1, 0.1, 0.1], jitter=0.2)
    x = mesh.nodes @ np.diag([1.4, 0.7, 0.9]) + 0.02 * np.random.default_rng(4).normal(size=mesh.nodes.shape)
    assert TetMesh(x, mesh.tetrahedra).volumes.min() < 0.0
    return mesh, x


def full(e):
    return np.array([[e[0], e[5], e[4]], [e[5], e[1], e[3]], [e[4], e[3], e[2]]])


@pytest.mark.parametrize("stretches", STRETCHES)
def test_the_strain_is_the_deviator_of_the_root(stretches, soft, rotation):
    f = rotation(2.0) @ np.diag(stretches) @ rotation(1.0).T
    found = made(TETRAHEDRON, soft)._strains(TETRAHEDRON.nodes @ f.T)[0]
    root = SLOPE * np.real(sqrtm(f.T @ f + WIDTH**2 * np.eye(3)))
    expected = root - np.trace(root) / 3 * np.eye(3)
    bound = 1e-13 if max(stretches) < 3.0 else 1e-11
    assert np.abs(full(found) - expected).max() < bound * max(1.0, np.abs(root).max())


@pytest.mark.parametrize("strain", [1e-6, 1e-3, 0.1])
def test_at_rest_its_slope_is_that_of_the_stretch(strain, soft):
    """A percent of a percent of the strain at ten percent."""
    stretch = np.diag([1 + strain, 1 - 0.3 * strain, 1 - 0.3 * strain])
    found = full(made(TETRAHEDRON, soft)._strains(TETRAHEDRON.nodes @ stretch)[0])
    expected = stretch - np.trace(stretch) / 3 * np.eye(3)
    assert np.abs(found - expected).max() < (2e-3 * strain + 1e-9 / strain * 1e-6) * strain + 1e-15


def test_force_and_stiffness_are_derivatives(crumpled, soft, force_of, stiffness_of, differences):
    mesh, x = crumpled
    prony = strained(mesh, soft, x)
    y = x + 0.002 * np.random.default_rng(5).normal(size=x.shape)
    slopes = differences(prony.energy, y, 1e-7).reshape(x.shape)
    force = force_of(prony, y)
    assert np.abs(force + slopes).max() < 1e-6 * np.abs(force).max()
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()
    assert np.abs(np.cross(y, force).sum(axis=0)).max() < 1e-12 * np.abs(force).max()
    stiffness = stiffness_of(prony, y)
    changes = differences(lambda z: force_of(prony, z), y, 1e-7)
    assert np.abs(stiffness + changes).max() < 1e-6 * np.abs(stiffness).max()
    assert np.abs(stiffness - stiffness.T).max() < 1e-14 * np.abs(stiffness).max()


def test_the_definite_stiffness_has_no_negative_eigenvalue_and_is_exact_without_stress(crumpled, soft, stiffness_of):
    mesh, x = crumpled
    prony = strained(mesh, soft, x)
    exact, definite = stiffness_of(prony, x), stiffness_of(prony, x, definite=True)
    size = np.abs(definite).max()
    assert np.linalg.eigvalsh(exact)[0] < -0.01 * size and np.linalg.eigvalsh(definite)[0] > -1e-13 * size
    fresh = made(mesh, soft)
    at_rest = stiffness_of(fresh, mesh.nodes), stiffness_of(fresh, mesh.nodes, definite=True)
    assert np.abs(at_rest[0] - at_rest[1]).max() < 1e-13 * np.abs(at_rest[1]).max()


def test_a_rotation_changes_nothing(crumpled, soft, rotation, force_of):
    mesh, x = crumpled
    prony = strained(mesh, soft, x)
    turn = rotation(2.5)
    away = x + 0.01
    assert prony.energy(away @ turn.T + 3.0) == pytest.approx(prony.energy(away), rel=1e-12)
    force = force_of(prony, away)
    assert np.abs(force_of(prony, away @ turn.T) - force @ turn.T).max() < 1e-12 * np.abs(force).max()


@pytest.mark.parametrize("share", [0.2, 0.9])
def test_at_once_the_body_is_corotational_with_a_larger_shear_modulus(crumpled, soft, share, force_of):
    """The bulk modulus stays; the elements of this check are not inverted, where the two strains differ."""
    mesh, _ = crumpled
    x = mesh.nodes @ np.diag([1.2, 0.9, 1.0]) + 0.002 * np.random.default_rng(4).normal(size=mesh.nodes.shape)
    mu, bulk = soft.shear_pa / (1 - share), soft.lame_pa + 2 / 3 * soft.shear_pa
    stiffer = type(soft)(9 * bulk * mu / (3 * bulk + mu), (3 * bulk - 2 * mu) / (6 * bulk + 2 * mu), 1000.0)
    together = force_of(LinearElements(mesh, soft), x) + force_of(made(mesh, soft, [share], [1.0]), x)
    expected = force_of(LinearElements(mesh, stiffer), x)
    assert np.abs(together - expected).max() < 1e-3 * np.abs(expected).max()


@pytest.mark.parametrize("stretches", STRETCHES)
def test_nothing_is_undefined_for_flat_inverted_and_extreme_elements(stretches, soft, rotation, force_of, stiffness_of):
    x = TETRAHEDRON.nodes @ (rotation(1.0) @ np.diag(stretches)).T
    prony = strained(TETRAHEDRON, soft, x)
    for values in (prony.energy(x), force_of(prony, x), stiffness_of(prony, x), stiffness_of(prony, x, True)):
        assert np.isfinite(values).all()
    prony.end(x)
    assert np.isfinite(prony.inner).all()
