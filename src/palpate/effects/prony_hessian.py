"""Second derivatives of the energy of viscous stress, in loops that the compiler vectorises.

With Q, Σ and Λ of prony_kernel, the second variation of Σ : Q is 2 Λ : (δFᵀδF − δQ²), where Q δQ + δQ Q = δ(FᵀF).
"""

import numba
import numpy as np

from palpate.effects.corotational_stress import ARITHMETIC
from palpate.effects.prony_kernel import SLOPE, half_root, inner_stresses, stretches

_PART = 64
"""Elements in one block, whose 12 variations are kept."""


@numba.njit(cache=True, error_model="numpy")
def add_stiffness(x, tetrahedra, gradients, stiffness, centers, definite, slots, values):
    """Add the Hessian's blocks [N/m] to ``values`` (n_blocks, 3, 3), those of element e at ``slots[e]`` (4, 4).

    ``definite`` leaves out the second derivatives of the strain.
    """
    f, q, scratch = np.empty((9, _PART)), np.empty((6, _PART)), np.empty((4, _PART))
    center, inner, g = np.empty((6, _PART)), np.zeros((6, _PART)), np.empty((12, _PART))
    stiff, energies = np.empty(_PART), np.empty(_PART)
    moved, dual, block = np.empty((72, _PART)), np.empty((72, _PART)), np.empty((9, _PART))
    for begin in range(0, len(tetrahedra), _PART):
        count = min(_PART, len(tetrahedra) - begin)
        for k in range(count):
            stiff[k] = stiffness[begin + k]
            for c in range(6):
                center[c, k] = centers[begin + k, c]
            for c in range(12):
                g[c, k] = gradients[begin + k, c // 3, c % 3]
        stretches(x, tetrahedra, gradients, begin, count, f, q, scratch)
        if not definite:
            inner_stresses(q, center, stiff, count, energies, inner)
        for p in range(12):
            _variation(f, q, g, p, count, moved)
            _dual(moved, stiff, inner, p, count, dual)
        for a in range(4):
            for b in range(a, 4):
                _block(moved, dual, inner, g, a, b, count, block)
                for k in range(count):
                    _add(block, k, slots[begin + k, a, b], slots[begin + k, b, a], a == b, values)


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _variation(f, q, g, p, count, moved):
    """Write δQ for the motion ``p`` = 3 a + i, of node a along axis i, into rows 6 p to 6 p + 5 of ``moved``."""
    a, i = p // 3, p % 3
    for k in range(count):
        g0, g1, g2 = g[3 * a, k], g[3 * a + 1, k], g[3 * a + 2, k]
        f0, f1, f2 = f[3 * i, k], f[3 * i + 1, k], f[3 * i + 2, k]
        xx, yy, zz = 2.0 * f0 * g0, 2.0 * f1 * g1, 2.0 * f2 * g2
        yz, zx, xy = f1 * g2 + f2 * g1, f2 * g0 + f0 * g2, f0 * g1 + f1 * g0
        found = half_root(q[0, k], q[1, k], q[2, k], q[3, k], q[4, k], q[5, k], xx, yy, zz, yz, zx, xy)
        moved[6 * p, k], moved[6 * p + 1, k], moved[6 * p + 2, k] = found[0], found[1], found[2]
        moved[6 * p + 3, k], moved[6 * p + 4, k], moved[6 * p + 5, k] = found[3], found[4], found[5]


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _dual(moved, stiff, inner, p, count, dual):
    """Write 2 k² ``stiff`` dev δQ − (Λ δQ + δQ Λ) of motion ``p`` into ``dual``, entries that occur twice doubled."""
    for k in range(count):
        a, b, c = moved[6 * p, k], moved[6 * p + 1, k], moved[6 * p + 2, k]
        d, e, g = moved[6 * p + 3, k], moved[6 * p + 4, k], moved[6 * p + 5, k]
        la, lb, lc, ld, le, lg = inner[0, k], inner[1, k], inner[2, k], inner[3, k], inner[4, k], inner[5, k]
        scale, mean = 2.0 * SLOPE * SLOPE * stiff[k], (a + b + c) / 3.0
        dual[6 * p, k] = scale * (a - mean) - (la * a + lg * g + le * e)
        dual[6 * p + 1, k] = scale * (b - mean) - (lg * g + lb * b + ld * d)
        dual[6 * p + 2, k] = scale * (c - mean) - (le * e + ld * d + lc * c)
        dual[6 * p + 3, k] = 2.0 * scale * d - (lg * e + lb * d + ld * c + g * le + b * ld + d * lc)
        dual[6 * p + 4, k] = 2.0 * scale * e - (la * e + lg * d + le * c + a * le + g * ld + e * lc)
        dual[6 * p + 5, k] = 2.0 * scale * g - (la * g + lg * b + le * d + a * lg + g * lb + e * ld)


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _block(moved, dual, inner, g, a, b, count, block):
    """Write the Hessian of the nodes ``a`` and ``b`` into ``block`` (9, _PART)."""
    for i in range(3):
        for j in range(3):
            p, q = 6 * (3 * a + i), 6 * (3 * b + j)
            for k in range(count):
                t = moved[p, k] * dual[q, k] + moved[p + 1, k] * dual[q + 1, k] + moved[p + 2, k] * dual[q + 2, k]
                t += moved[p + 3, k] * dual[q + 3, k] + moved[p + 4, k] * dual[q + 4, k]
                block[3 * i + j, k] = t + moved[p + 5, k] * dual[q + 5, k]
    for k in range(count):
        g0, g1, g2 = g[3 * a, k], g[3 * a + 1, k], g[3 * a + 2, k]
        h0, h1, h2 = g[3 * b, k], g[3 * b + 1, k], g[3 * b + 2, k]
        same = g0 * (inner[0, k] * h0 + inner[5, k] * h1 + inner[4, k] * h2)
        same += g1 * (inner[5, k] * h0 + inner[1, k] * h1 + inner[3, k] * h2)
        same += g2 * (inner[4, k] * h0 + inner[3, k] * h1 + inner[2, k] * h2)
        block[0, k] += same
        block[4, k] += same
        block[8, k] += same


@numba.njit(cache=True, error_model="numpy")
def _add(block, k, slot, mirrored, alone, values):
    """Add a column of ``block`` at its slot and, unless it stands ``alone``, transposed at the mirrored one."""
    for i in range(3):
        for j in range(3):
            values[slot, i, j] += block[3 * i + j, k]
            if not alone:
                values[mirrored, j, i] += block[3 * i + j, k]
