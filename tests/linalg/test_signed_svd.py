"""The signed SVD against LAPACK's, on good and bad matrices."""

import numpy as np
import pytest
from scipy.linalg import polar

from palpate.linalg.polar import signed_svd


def rotations(random, count):
    q = np.linalg.qr(random.normal(size=(count, 3, 3)))[0]
    q[:, :, 0] *= np.linalg.det(q)[:, None]
    return q


def with_values(random, values):
    left, right = rotations(random, len(values)), rotations(random, len(values))
    return np.einsum("nij,nj,nkj->nik", left, values, right)


def family(name, count=3000):
    random = np.random.default_rng(1)
    zero = np.zeros(count)
    if name == "random":
        return random.normal(size=(count, 3, 3))
    if name == "inverted":
        matrices = random.normal(size=(count, 3, 3))
        matrices[np.linalg.det(matrices) > 0] *= -1
        return matrices
    if name == "rank two":
        return with_values(random, np.stack([*random.uniform(0.1, 3, (2, count)), zero], axis=1))
    if name == "rank one":
        return with_values(random, np.stack([random.uniform(0.1, 3, count), zero, zero], axis=1))
    if name == "ill-conditioned":
        return with_values(random, 10.0 ** random.uniform(-12, 0, (count, 3)))
    if name == "equal values":  # rotations, also scaled, and turned inside out
        values = random.uniform(0.5, 2, (count, 1)) * [1, 1, 1] * random.choice([-1, 1], (count, 3))
        return with_values(random, values)
    if name == "half turn":  # rotated by almost or exactly π, hardly stretched
        axis = random.normal(size=(count, 3))
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        half = 2 * axis[:, :, None] * axis[:, None, :] - np.eye(3)
        return half + (10.0 ** random.uniform(-16, -2, count))[:, None, None] * random.normal(size=(count, 3, 3))
    if name == "diagonal":
        return np.einsum("ni,ij->nij", random.choice([-2, -1, -0.5, 0, 0.5, 1, 2], (count, 3)), np.eye(3))
    scales = 10.0 ** random.uniform(-70, 70, count)  # "scaled"
    return scales[:, None, None] * random.normal(size=(count, 3, 3))


FAMILIES = ["random", "inverted", "rank two", "rank one", "ill-conditioned", "equal values", "half turn"]
FAMILIES += ["diagonal", "scaled"]


def decompose(matrices):
    u, v, s = np.empty_like(matrices), np.empty_like(matrices), np.empty(matrices.shape[:2])
    for i in range(len(matrices)):
        signed_svd(matrices[i], u[i], s[i], v[i])
    return u, s, v


@pytest.mark.parametrize("name", FAMILIES)
def test_decomposes_like_lapack(name):
    matrices = family(name)
    u, s, v = decompose(matrices)
    largest = np.maximum(np.linalg.norm(matrices, 2, axis=(1, 2)), 1e-300)
    rebuilt = np.einsum("nij,nj,nkj->nik", u, s, v)
    assert (np.abs(rebuilt - matrices).max(axis=(1, 2)) / largest).max() < 1e-12
    for q in (u, v):
        assert np.abs(np.swapaxes(q, 1, 2) @ q - np.eye(3)).max() < 1e-12
        assert np.abs(np.linalg.det(q) - 1.0).max() < 1e-12
    expected = np.linalg.svd(matrices, compute_uv=False)
    assert (np.abs(np.abs(s) - expected).max(axis=1) / largest).max() < 1e-12
    assert (np.diff(-np.abs(s), axis=1).min(axis=1) >= -1e-14 * largest).all()


def test_only_the_last_value_takes_the_sign_of_the_determinant():
    matrices = np.concatenate([family("random"), family("inverted")])
    _, s, _ = decompose(matrices)
    assert (s[:, :2] >= 0).all()
    assert np.array_equal(np.sign(s[:, 2]), np.sign(np.linalg.det(matrices)))


def test_the_rotation_is_the_polar_one():
    for matrix in family("random", 300):
        if np.linalg.det(matrix) < 0:
            continue
        u, _, v = decompose(matrix[None])
        assert np.abs(u[0] @ v[0].T - polar(matrix)[0]).max() < 1e-10


def test_nothing_comes_from_nothing():
    u, s, v = decompose(np.zeros((1, 3, 3)))
    assert np.array_equal(s[0], np.zeros(3))
    assert np.array_equal(u[0], np.eye(3)) and np.array_equal(v[0], np.eye(3))


def test_small_values_are_relatively_accurate():
    """Where columns differ in scale, one-sided Jacobi finds even the smallest value to many digits."""
    random = np.random.default_rng(2)
    scales = np.array([1.0, 1e-5, 1e-10])
    for left in rotations(random, 200):
        _, s, _ = decompose((left * scales)[None])
        assert np.abs(s[0] / scales - 1.0).max() < 1e-12
