"""Second derivatives of the corotational energy at many deformation gradients, in loops that the compiler vectorises.

Blocks, pairs and gradients are those of ``principal_blocks``.
"""

import numba
import numpy as np

from palpate.effects.corotational_law import second
from palpate.effects.corotational_stress import ARITHMETIC, BLOCK, rotations
from palpate.effects.principal_blocks import PAIRS, clamp, clamp_pairs, write_blocks
from palpate.linalg.signed_svd import signed_svd

_TIE = 1e-12
"""Twists below zero by less than this part of μ are rounding: at rest those of rotations are zero."""


@numba.njit(cache=True, error_model="numpy")
def hessians(f, gradients, shares, count, mu, lam, definite, rotated, blocks):
    """Write the Hessians of the first ``count`` columns of ``f`` (9, BLOCK) into ``blocks`` (54, BLOCK) [N/m].

    gradients : (9, BLOCK), the three vectors g of each column [1/m]; shares : (BLOCK,), their volumes [m³]
    mu, lam : (count,), Lamé's constants of each column [Pa]
    definite : replaces negative eigenvalues of ∂²Ψ/∂F² by zero (Smith, de Goes, Kim 2019, section 5)
    rotated : (15, BLOCK), scratch
    """
    sure, scratch = np.empty(BLOCK, dtype=np.bool_), np.empty((7, 3, 3))
    rotations(f, rotated, count, sure)
    if definite:
        _without_clamp(f, rotated, count, mu, lam, sure)
    _twists(f, gradients, shares, count, mu, lam, rotated)
    for pair in range(6):
        _polar_blocks(rotated, shares, count, mu, lam, pair, blocks)
    for k in range(count):
        if not sure[k]:
            _principal_blocks(f, gradients, shares[k], k, mu[k], lam[k], definite, scratch, blocks)


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _without_clamp(f, r, count, mu, lam, sure):
    """Leave only those columns sure whose Hessian has no negative eigenvalue.

    Those that can be negative are 2μ + 2c/(sᵢ + sⱼ) with c = λ tr(S − I) − 2μ: none is if G + c/μ I is positive
    semidefinite, where G = tr(S) I − S has the eigenvalues sᵢ + sⱼ.
    """
    for k in range(count):
        s00 = f[0, k] * r[0, k] + f[1, k] * r[1, k] + f[2, k] * r[2, k]
        s11 = f[3, k] * r[3, k] + f[4, k] * r[4, k] + f[5, k] * r[5, k]
        s22 = f[6, k] * r[6, k] + f[7, k] * r[7, k] + f[8, k] * r[8, k]
        a01 = -(f[0, k] * r[3, k] + f[1, k] * r[4, k] + f[2, k] * r[5, k])
        a02 = -(f[0, k] * r[6, k] + f[1, k] * r[7, k] + f[2, k] * r[8, k])
        a12 = -(f[3, k] * r[6, k] + f[4, k] * r[7, k] + f[5, k] * r[8, k])
        shift = (lam[k] * (s00 + s11 + s22 - 3.0) - 2.0 * mu[k]) / mu[k] + _TIE
        a00, a11, a22 = s11 + s22 + shift, s00 + s22 + shift, s00 + s11 + shift
        minor = a00 * a11 - a01 * a01
        det = a22 * minor - a12 * (a00 * a12 - a01 * a02) + a02 * (a01 * a12 - a11 * a02)
        sure[k] = sure[k] & (a00 >= 0.0) & (minor >= 0.0) & (det >= 0.0)


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _twists(f, gradients, shares, count, mu, lam, rotated):
    """Replace the rotations in ``rotated`` by the rotated gradients R g, and write c V (R G Rᵀ)⁻¹ into rows 9 to 14."""
    for k in range(count):
        r00, r01, r02 = rotated[0, k], rotated[1, k], rotated[2, k]
        r10, r11, r12 = rotated[3, k], rotated[4, k], rotated[5, k]
        r20, r21, r22 = rotated[6, k], rotated[7, k], rotated[8, k]
        s00 = f[0, k] * r00 + f[1, k] * r01 + f[2, k] * r02
        s11 = f[3, k] * r10 + f[4, k] * r11 + f[5, k] * r12
        s22 = f[6, k] * r20 + f[7, k] * r21 + f[8, k] * r22
        a01 = -(f[0, k] * r10 + f[1, k] * r11 + f[2, k] * r12)
        a02 = -(f[0, k] * r20 + f[1, k] * r21 + f[2, k] * r22)
        a12 = -(f[3, k] * r20 + f[4, k] * r21 + f[5, k] * r22)
        a00, a11, a22 = s11 + s22, s00 + s22, s00 + s11
        c00, c01, c02 = a11 * a22 - a12 * a12, a02 * a12 - a01 * a22, a01 * a12 - a02 * a11
        c11, c12, c22 = a00 * a22 - a02 * a02, a01 * a02 - a00 * a12, a00 * a11 - a01 * a01
        weight = shares[k] * (lam[k] * (s00 + s11 + s22 - 3.0) - 2.0 * mu[k]) / (a00 * c00 + a01 * c01 + a02 * c02)
        rotated[9, k], rotated[10, k], rotated[11, k] = weight * c00, weight * c01, weight * c02
        rotated[12, k], rotated[13, k], rotated[14, k] = weight * c11, weight * c12, weight * c22
        g0, g1, g2 = gradients[0, k], gradients[1, k], gradients[2, k]
        g3, g4, g5 = gradients[3, k], gradients[4, k], gradients[5, k]
        g6, g7, g8 = gradients[6, k], gradients[7, k], gradients[8, k]
        rotated[0, k], rotated[3, k] = r00 * g0 + r01 * g1 + r02 * g2, r00 * g3 + r01 * g4 + r02 * g5
        rotated[6, k], rotated[1, k] = r00 * g6 + r01 * g7 + r02 * g8, r10 * g0 + r11 * g1 + r12 * g2
        rotated[4, k], rotated[7, k] = r10 * g3 + r11 * g4 + r12 * g5, r10 * g6 + r11 * g7 + r12 * g8
        rotated[2, k], rotated[5, k] = r20 * g0 + r21 * g1 + r22 * g2, r20 * g3 + r21 * g4 + r22 * g5
        rotated[8, k] = r20 * g6 + r21 * g7 + r22 * g8


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _polar_blocks(rotated, shares, count, mu, lam, pair, blocks):
    """Write the block V (2μ g·h I + λ g hᵀ) + [g]ᵀ M [h] of rotated gradients g and h; [g] is the matrix of g ×.

    M is what ``_twists`` has written: the derivative of R turns by G⁻¹ times the axis of Rᵀ δF − δFᵀ R.
    """
    c, d = PAIRS[pair]
    for k in range(count):
        g0, g1, g2 = rotated[3 * c, k], rotated[3 * c + 1, k], rotated[3 * c + 2, k]
        h0, h1, h2 = rotated[3 * d, k], rotated[3 * d + 1, k], rotated[3 * d + 2, k]
        m00, m01, m02 = rotated[9, k], rotated[10, k], rotated[11, k]
        m11, m12, m22 = rotated[12, k], rotated[13, k], rotated[14, k]
        y00, y01, y02 = m01 * h2 - m02 * h1, m02 * h0 - m00 * h2, m00 * h1 - m01 * h0
        y10, y11, y12 = m11 * h2 - m12 * h1, m12 * h0 - m01 * h2, m01 * h1 - m11 * h0
        y20, y21, y22 = m12 * h2 - m22 * h1, m22 * h0 - m02 * h2, m02 * h1 - m12 * h0
        both, volume = 2.0 * mu[k] * shares[k] * (g0 * h0 + g1 * h1 + g2 * h2), lam[k] * shares[k]
        h0, h1, h2 = volume * h0, volume * h1, volume * h2
        blocks[9 * pair, k] = both + g0 * h0 + g2 * y10 - g1 * y20
        blocks[9 * pair + 1, k] = g0 * h1 + g2 * y11 - g1 * y21
        blocks[9 * pair + 2, k] = g0 * h2 + g2 * y12 - g1 * y22
        blocks[9 * pair + 3, k] = g1 * h0 + g0 * y20 - g2 * y00
        blocks[9 * pair + 4, k] = both + g1 * h1 + g0 * y21 - g2 * y01
        blocks[9 * pair + 5, k] = g1 * h2 + g0 * y22 - g2 * y02
        blocks[9 * pair + 6, k] = g2 * h0 + g1 * y00 - g0 * y10
        blocks[9 * pair + 7, k] = g2 * h1 + g1 * y01 - g0 * y11
        blocks[9 * pair + 8, k] = both + g2 * h2 + g1 * y02 - g0 * y12


@numba.njit(cache=True, error_model="numpy")
def _principal_blocks(f, gradients, share, k, mu, lam, definite, scratch, blocks):
    """Write the blocks of column ``k`` from the principal stretches; scratch : (7, 3, 3)."""
    given, u, v, curvatures = scratch[0], scratch[1], scratch[2], scratch[3]
    s, flips, twists = scratch[4, 0], scratch[4, 1], scratch[4, 2]
    for i in range(9):
        given[i // 3, i % 3] = f[i, k]
    signed_svd(given, u, s, v)
    bent = second(s, mu, lam, curvatures, flips, twists)
    if definite and bent:
        clamp(curvatures, flips, twists)
    elif definite:
        clamp_pairs(flips, twists)
    write_blocks(u, v, curvatures, flips, twists, gradients, share, k, scratch[5], scratch[6], blocks)
