"""Rotations, corotational stresses and energies of many deformation gradients, in loops that the compiler vectorises.

A block is an array (9, BLOCK) with the entries of F, row by row; each column is one deformation gradient. Rotations
are found by Newton's iteration R ← (R + R⁻ᵀ)/2. From its first step on every singular value of R is at least 1, so that
‖R‖² − 3 bounds the distance of each from 1 (Higham 1986). Where it converges and det F > 0, the stretches lie between
about 1/50 and 50 …, and R is the rotation of the signed singular value decomposition; other elements, collapsed,
inverted or extreme, are left to that decomposition, which also knows of the energy's fold.
"""

import numba
import numpy as np

from palpate.effects.corotational_law import first
from palpate.linalg.signed_svd import signed_svd

BLOCK = 256
"""Deformation gradients in one block: their F and R stay in the first cache."""
_FEWEST, _MOST = 4, 8
_ROUNDING = 1e-14
ARITHMETIC = {"contract", "nsz", "arcp"}


@numba.njit(cache=True, error_model="numpy")
def rotations(f, r, count, sure):
    """Write the rotations of the first ``count`` columns of ``f`` into ``r``, and which of them are ``sure``.

    f, r : (9, BLOCK); sure : (BLOCK,) bool
    """
    for i in range(9):
        for k in range(count):
            r[i, k] = f[i, k]
    for _ in range(_FEWEST):
        _step(r, count)
    for _ in range(_FEWEST, _MOST):
        if _settled(f, r, count, sure) == count:
            break
        _step(r, count)
    _settled(f, r, count, sure)


@numba.njit(cache=True, error_model="numpy")
def stresses(f, p, count, mu, lam, energies, sure):
    """Write P = ∂Ψ/∂F [Pa] of the first ``count`` columns of ``f`` into ``p``, and Ψ [J/m³] into ``energies``.

    f, p : (9, BLOCK); mu, lam : (count,) Lamé's constants of each column [Pa]; energies : (BLOCK,)
    sure : (BLOCK,) bool, scratch
    """
    rotations(f, p, count, sure)
    _polar_stresses(f, p, count, mu, lam, energies)
    for k in range(count):
        if not sure[k]:
            energies[k] = _principal_stress(f, p, k, mu[k], lam[k])


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _step(r, count):
    for k in range(count):
        r00, r01, r02 = r[0, k], r[1, k], r[2, k]
        r10, r11, r12 = r[3, k], r[4, k], r[5, k]
        r20, r21, r22 = r[6, k], r[7, k], r[8, k]
        c00, c01, c02 = r11 * r22 - r12 * r21, r12 * r20 - r10 * r22, r10 * r21 - r11 * r20
        c10, c11, c12 = r02 * r21 - r01 * r22, r00 * r22 - r02 * r20, r01 * r20 - r00 * r21
        c20, c21, c22 = r01 * r12 - r02 * r11, r02 * r10 - r00 * r12, r00 * r11 - r01 * r10
        h = 0.5 / (r00 * c00 + r01 * c01 + r02 * c02)
        r[0, k], r[1, k], r[2, k] = 0.5 * r00 + h * c00, 0.5 * r01 + h * c01, 0.5 * r02 + h * c02
        r[3, k], r[4, k], r[5, k] = 0.5 * r10 + h * c10, 0.5 * r11 + h * c11, 0.5 * r12 + h * c12
        r[6, k], r[7, k], r[8, k] = 0.5 * r20 + h * c20, 0.5 * r21 + h * c21, 0.5 * r22 + h * c22


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _settled(f, r, count, sure):
    """Return the number of columns that need no further step, among them those of det F < 0, which are not sure."""
    settled = 0
    for k in range(count):
        f00, f01, f02 = f[0, k], f[1, k], f[2, k]
        c0 = f[4, k] * f[8, k] - f[5, k] * f[7, k]
        c1 = f[5, k] * f[6, k] - f[3, k] * f[8, k]
        c2 = f[3, k] * f[7, k] - f[4, k] * f[6, k]
        norm = r[0, k] * r[0, k] + r[1, k] * r[1, k] + r[2, k] * r[2, k] + r[3, k] * r[3, k] + r[4, k] * r[4, k]
        norm += r[5, k] * r[5, k] + r[6, k] * r[6, k] + r[7, k] * r[7, k] + r[8, k] * r[8, k]
        done, proper = norm - 3.0 < _ROUNDING, f00 * c0 + f01 * c1 + f02 * c2 > 0.0
        sure[k] = done & proper
        settled += 1 if done or not proper else 0
    return settled


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _polar_stresses(f, r, count, mu, lam, energies):
    """Replace the rotations ``r`` by P = 2μ (F − R) + λ tr(S − I) R, where tr S = R : F."""
    for k in range(count):
        r00, r01, r02 = r[0, k], r[1, k], r[2, k]
        r10, r11, r12 = r[3, k], r[4, k], r[5, k]
        r20, r21, r22 = r[6, k], r[7, k], r[8, k]
        strain = f[0, k] * r00 + f[1, k] * r01 + f[2, k] * r02 + f[3, k] * r10 + f[4, k] * r11 + f[5, k] * r12
        strain += f[6, k] * r20 + f[7, k] * r21 + f[8, k] * r22 - 3.0
        d00, d01, d02 = f[0, k] - r00, f[1, k] - r01, f[2, k] - r02
        d10, d11, d12 = f[3, k] - r10, f[4, k] - r11, f[5, k] - r12
        d20, d21, d22 = f[6, k] - r20, f[7, k] - r21, f[8, k] - r22
        squares = d00 * d00 + d01 * d01 + d02 * d02 + d10 * d10 + d11 * d11 + d12 * d12
        squares += d20 * d20 + d21 * d21 + d22 * d22
        pressure, twice = lam[k] * strain, 2.0 * mu[k]
        energies[k] = mu[k] * squares + 0.5 * pressure * strain
        r[0, k], r[1, k] = twice * d00 + pressure * r00, twice * d01 + pressure * r01
        r[2, k], r[3, k] = twice * d02 + pressure * r02, twice * d10 + pressure * r10
        r[4, k], r[5, k] = twice * d11 + pressure * r11, twice * d12 + pressure * r12
        r[6, k], r[7, k] = twice * d20 + pressure * r20, twice * d21 + pressure * r21
        r[8, k] = twice * d22 + pressure * r22


@numba.njit(cache=True, error_model="numpy")
def _principal_stress(f, p, k, mu, lam):
    """Write P = U diag(∂Ψ/∂s) Vᵀ [Pa] of column ``k`` of ``f`` into that of ``p``, and return Ψ [J/m³]."""
    u, v, s, principal = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(3)
    signed_svd(f[:, k].copy().reshape(3, 3), u, s, v)
    energy = first(s, mu, lam, principal)
    for i in range(3):
        for j in range(3):
            stress = u[i, 0] * principal[0] * v[j, 0] + u[i, 1] * principal[1] * v[j, 1]
            p[3 * i + j, k] = stress + u[i, 2] * principal[2] * v[j, 2]
    return energy
