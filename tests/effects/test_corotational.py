"""Corotational elasticity against singular values, finite differences and scikit-fem."""

import numpy as np
import pytest
from scipy.linalg import polar
from scipy.spatial.transform import Rotation

from palpate.bodies.mesh import TetMesh
from palpate.effects.corotational import BLOCK, FOLD, hessians, rotations, stresses
from palpate.effects.linear_elements import LinearElements
from palpate.effects.principal import PAIRS

TETRAHEDRON = TetMesh(np.array([[0.0, 0, 0], [1.1, 0.1, 0], [0.2, 0.9, 0.1], [0, 0.2, 1.3]]), np.array([[0, 1, 2, 3]]))
STRETCHES = {
    "rest": [1, 1, 1],
    "stretched": [1.5, 1.2, 0.8],
    "crushed": [0.5, 0.3, 0.2],
    "flat": [1.2, 0.9, 0],
    "line": [1.2, 0.1, 0],
    "inverted": [1.2, 0.9, -0.4],
    "inside out": [1.5, 1.1, -0.9],
}
# where the rotation is about to jump, and the energy's fold is rounded off
FOLDS = {"at the fold": [1.2, 0.6, -0.6], "near the fold": [1.2, 0.6, -0.58], "folded line": [1.2, 0.01, 0.01]}


def deformed(stretches, rotation):
    """The one tetrahedron with these signed singular values and skew axes."""
    return TETRAHEDRON.nodes @ (rotation(1.0) @ np.diag(stretches) @ rotation(2.0).T).T


@pytest.mark.parametrize("name", STRETCHES | FOLDS)
def test_derivatives_of_collapsed_and_inverted_elements(name, soft, rotation, differences):
    elasticity = LinearElements(TETRAHEDRON, soft)
    x = deformed((STRETCHES | FOLDS)[name], rotation)
    force, stiffness = elasticity.force(x), elasticity.stiffness(x).toarray()
    slope = differences(elasticity.energy, x, 1e-5).reshape(x.shape)
    assert np.abs(force + slope).max() < 1e-7 * soft.young_pa
    slope = -differences(elasticity.force, x, 1e-6)
    assert np.abs(stiffness - slope).max() < 1e-7 * np.abs(stiffness).max()


MU, LAM = 1100.0, 1700.0
MODULI = np.full(BLOCK, MU), np.full(BLOCK, LAM)
KINDS = {
    "near rest": (0.99, 1.01, 1),
    "moderate": (0.6, 1.6, 1),
    "where Newton's iteration only just converges": (0.05, 20.0, 1),
    "extreme": (1e-4, 1e4, 1),
    "inverted": (0.3, 1.5, -1),
    "extreme and inverted": (1e-4, 1e4, -1),
}


def gradients(low, high, sign, count=BLOCK):
    """Deformation gradients (count, 3, 3) of skew axes, with stretches that are spread evenly by their logarithms."""
    random = np.random.default_rng(0)
    u, v = (Rotation.random(count, random_state=seed).as_matrix() for seed in (1, 2))
    s = np.exp(random.uniform(np.log(low), np.log(high), (count, 3)))
    s[:, 2] *= sign
    return u * s[:, None, :] @ v


def corotational_stress_block(f):
    columns = np.zeros((9, BLOCK))
    columns[:, : len(f)] = f.reshape(len(f), 9).T
    return columns


def stress_of(f):
    """Energies and stresses of F (n, 3, 3) by the law's formula."""
    p, energies = np.empty((9, BLOCK)), np.empty(BLOCK)
    stresses(corotational_stress_block(f), p, len(f), *MODULI, energies, np.empty(BLOCK, dtype=bool))
    return energies[: len(f)], p.T[: len(f)].reshape(-1, 3, 3)


def expected(f):
    """Energy and stress of one F from numpy's decomposition."""
    u, s, v = np.linalg.svd(f)
    for turned in (u, v):  # proper rotations, the last singular value signed
        if np.linalg.det(turned) < 0:
            turned[(slice(None), 2) if turned is u else (2, slice(None))] *= -1
            s[2] *= -1
    t = s[1] + s[2]
    q = t / FOLD
    tau, slope = (FOLD * (3 + 6 * q**2 - q**4) / 8, (3 * q - q**3) / 2) if t < FOLD else (t, 1.0)
    trace = s[0] + tau
    energy = MU * (np.sum(s**2) - 2 * trace + 3) + LAM / 2 * (trace - 3) ** 2
    principal = 2 * MU * s + (LAM * (trace - 3) - 2 * MU) * np.array([1.0, slope, slope])
    return energy, u @ np.diag(principal) @ v


def bound(f):
    """The effect of rounding F on the stress: it turns the rotation by about ε ‖F‖ / max(s₂ + s₃, FOLD)."""
    s = np.linalg.svd(f, compute_uv=False)
    return 1e-13 * MU * max(1.0, s[0]) * max(1.0, s[0] / max(FOLD, s[1] + np.sign(np.linalg.det(f)) * s[2]))


@pytest.mark.parametrize("kinds", [*((kind,) for kind in KINDS), tuple(KINDS)])
def test_stresses_are_those_of_the_singular_values(kinds):
    """In a block of all kinds, too: a column that needs more steps, or the decomposition, changes no other."""
    f = np.concatenate([gradients(*KINDS[kind], count=BLOCK // len(kinds)) for kind in kinds])
    f[7], f[8], f[9] = 0.0, np.diag([1.0, 0.0, 0.0]), 1e-200 * np.eye(3)
    energies, found = stress_of(f)
    assert np.isfinite(found).all()
    for k in np.setdiff1d(np.arange(len(f)), [7, 8, 9]):
        energy, stress = expected(f[k])
        assert energies[k] == pytest.approx(energy, rel=1e-12, abs=1e-12 * MU)
        assert np.abs(found[k] - stress).max() < bound(f[k])


@pytest.mark.parametrize("kind", KINDS)
def test_sure_rotations_are_the_nearest_ones(kind):
    f = gradients(*KINDS[kind])
    r, sure = np.empty((9, BLOCK)), np.empty(BLOCK, dtype=bool)
    rotations(corotational_stress_block(f), r, BLOCK, sure)
    found = r.T.reshape(-1, 3, 3)
    assert sure.all() == (kind in ("near rest", "moderate"))
    assert sure.any() == ("inverted" not in kind)
    for k in np.flatnonzero(sure):
        assert np.abs(found[k] - polar(f[k])[0]).max() < 1e-13
        assert np.linalg.det(found[k]) > 0


def hessian_of(f, definite=False):
    """∂²Ψ/∂F² (n, 9, 9): with the unit vectors as gradients g, column c of F is what pulls along g_c."""
    g, blocks = np.tile(np.eye(3).reshape(9, 1), BLOCK), np.empty((54, BLOCK))
    hessians(corotational_stress_block(f), g, np.ones(BLOCK), len(f), *MODULI, definite, np.empty((15, BLOCK)), blocks)
    whole = np.empty((len(f), 3, 3, 3, 3))  # i, c, j, d
    for pair, (c, d) in enumerate(PAIRS):
        part = blocks[9 * pair : 9 * pair + 9, : len(f)].T.reshape(-1, 3, 3)
        whole[:, :, c, :, d], whole[:, :, d, :, c] = part, np.swapaxes(part, 1, 2)
    return whole.reshape(len(f), 9, 9)


@pytest.mark.parametrize("kind", ["near rest", "moderate", "where Newton's iteration only just converges", "inverted"])
def test_hessians_are_differences_of_stresses(kind):
    f = gradients(*KINDS[kind])
    found, step = hessian_of(f), 1e-6
    for entry, delta in enumerate(step * np.eye(9).reshape(9, 3, 3)):
        slope = (stress_of(f + delta)[1] - stress_of(f - delta)[1]).reshape(-1, 9) / (2 * step)
        wrong = np.abs(found[:, entry] - slope).max(axis=1)
        assert np.median(wrong) < 1e-8 * MU
        # the inverted ones close to where the energy's axes are equally near have large third derivatives
        assert (wrong < 1e-4 * np.abs(found).max(axis=(1, 2))).mean() > 0.98


@pytest.mark.parametrize("kind", KINDS)
def test_definite_hessians_lose_their_negative_eigenvalues_and_nothing_else(kind):
    f = gradients(*KINDS[kind])
    exact, definite = hessian_of(f), hessian_of(f, definite=True)
    values, vectors = np.linalg.eigh(exact)
    clamped = (vectors * np.maximum(values, 0.0)[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    assert (values[:, 0] < -1.0).any()
    scale = np.abs(values).max(axis=1)[:, None, None]
    assert (np.abs(definite - clamped) / scale).max() < 1e-9
