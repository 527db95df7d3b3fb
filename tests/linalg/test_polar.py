"""Rotations of good and bad matrices, against LAPACK where there is only one answer."""

import numpy as np
import pytest
from scipy.linalg import polar
from scipy.spatial.transform import Rotation

from palpate.errors import InputError
from palpate.linalg.polar import nearest, nearest_rotation, signed_svd

FAMILIES = ["normal", "inverted", "conditioned", "flat", "straight", "zero", "denormal", "huge", "half turn", "equal"]
SVD_FAMILIES = [name for name in FAMILIES if name not in ("denormal", "huge")] + ["diagonal", "scaled"]


def with_values(random, values):
    left, right = (Rotation.random(len(values), rng=random).as_matrix() for _ in range(2))
    return np.einsum("nij,nj,nkj->nik", left, values, right)


def family(name, count=20_000):
    random = np.random.default_rng([*FAMILIES, *SVD_FAMILIES].index(name))
    normal = random.normal(size=(count, 3, 3))
    if name == "inverted":
        return normal * -np.sign(np.linalg.det(normal))[:, None, None]
    if name == "conditioned":  # up to 1e12, half of them inverted
        return with_values(random, 10.0 ** random.uniform(-12, 0, (count, 3)) * random.choice([-1, 1], (count, 1)))
    if name in ("flat", "straight"):
        return with_values(random, random.uniform(0.1, 3, (count, 3)) * ([1, 1, 0] if name == "flat" else [1, 0, 0]))
    if name == "half turn":  # by π or almost, hardly stretched
        axis = random.normal(size=(count, 3))
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        stretch = (10.0 ** random.uniform(-17, -1, count))[:, None, None] * normal
        return 2 * axis[:, :, None] * axis[:, None, :] - np.eye(3) + stretch
    if name == "equal":  # rotations, scaled, and turned inside out
        return with_values(random, random.uniform(0.5, 2, (count, 1)) * random.choice([-1, 1], (count, 3)))
    if name == "diagonal":
        return random.choice([-2, -1, -0.5, 0, 0.5, 1, 2], (count, 3))[:, None, :] * np.eye(3)
    if name == "scaled":
        return (10.0 ** random.uniform(-70, 70, count))[:, None, None] * normal
    return normal * {"normal": 1.0, "zero": 0.0, "denormal": 1e-310, "huge": 1e300}[name]


@pytest.mark.parametrize("name", FAMILIES)
def test_every_matrix_has_a_rotation_and_it_is_the_nearest(name):
    matrices = family(name)
    found = np.array([nearest_rotation(matrix) for matrix in matrices])
    assert np.abs(np.swapaxes(found, 1, 2) @ found - np.eye(3)).max() < 1e-12
    assert np.abs(np.linalg.det(found) - 1.0).max() < 1e-12
    largest = np.abs(matrices).max(axis=(1, 2), keepdims=True)
    scaled = np.divide(matrices, largest, out=np.zeros_like(matrices), where=largest > 0)
    u, s, vt = np.linalg.svd(scaled)
    sign = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    u[:, :, 2] *= sign[:, None]
    gap = s[:, 1] + sign * s[:, 2]
    best = s[:, 0] + gap  # the most that tr(RᵀA) can be
    # a denormal has few digits, but both sides see the same ones
    assert (np.einsum("nij,nij->n", found, scaled) >= best - 1e-13).all()
    unique = gap > 1e-9
    wrong = np.abs(found - u @ vt).max(axis=(1, 2))[unique]
    assert (wrong < 1e-13 * s[unique, 0] / gap[unique]).all()


@pytest.mark.parametrize("name", FAMILIES)
def test_a_guess_however_bad_changes_nothing_but_rounding(name):
    matrices, random = family(name)[:500], np.random.default_rng(0)
    work, found = np.empty((4, 3, 3)), np.empty((3, 3))
    for matrix in matrices:
        cold = nearest_rotation(matrix)
        turn = Rotation.random(rng=random).as_quat()
        nearest(matrix, turn, work, found)
        largest = np.abs(matrix).max() or 1.0
        assert np.abs(found.T @ found - np.eye(3)).max() < 1e-12
        assert np.vdot(found, matrix / largest) >= np.vdot(cold, matrix / largest) - 1e-13


@pytest.mark.parametrize("entry", [np.nan, np.inf])
def test_what_is_not_finite_is_refused(entry):
    with pytest.raises(InputError, match="NaN or infinite"):
        nearest_rotation(np.full((3, 3), entry))


def decompose(matrices):
    u, v, s = np.empty_like(matrices), np.empty_like(matrices), np.empty(matrices.shape[:2])
    for i in range(len(matrices)):
        signed_svd(matrices[i], u[i], s[i], v[i])
    return u, s, v


@pytest.mark.parametrize("name", SVD_FAMILIES)
def test_decomposes_like_lapack(name):
    matrices = family(name, 3000)
    u, s, v = decompose(matrices)
    largest = np.maximum(np.linalg.norm(matrices, 2, axis=(1, 2)), 1e-300)
    rebuilt = np.einsum("nij,nj,nkj->nik", u, s, v)
    assert (np.abs(rebuilt - matrices).max(axis=(1, 2)) / largest).max() < 1e-12
    upright = np.linalg.det(matrices) > 1e-3 * largest**3
    expected = np.array([polar(matrix)[0] for matrix in matrices[upright][:300]]).reshape(-1, 3, 3)
    assert np.abs(u[upright][:300] @ np.swapaxes(v[upright][:300], 1, 2) - expected).max(initial=0.0) < 1e-10
    for q in (u, v):
        assert np.abs(np.swapaxes(q, 1, 2) @ q - np.eye(3)).max() < 1e-12
        assert np.abs(np.linalg.det(q) - 1.0).max() < 1e-12
    expected = np.linalg.svd(matrices, compute_uv=False)
    assert (np.abs(np.abs(s) - expected).max(axis=1) / largest).max() < 1e-12
    assert (np.diff(-np.abs(s), axis=1).min(axis=1) >= -1e-14 * largest).all()
    assert (s[:, :2] >= 0).all()  # the last value alone takes the sign of the determinant


def test_small_values_are_relatively_accurate():
    """Where columns differ in scale, one-sided Jacobi finds even the smallest value to many digits."""
    random = np.random.default_rng(2)
    scales = np.array([1.0, 1e-5, 1e-10])
    for left in Rotation.random(200, rng=random).as_matrix():
        _, s, _ = decompose((left * scales)[None])
        assert np.abs(s[0] / scales - 1.0).max() < 1e-12
