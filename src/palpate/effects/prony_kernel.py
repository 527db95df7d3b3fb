"""Strain, energy and force of viscous stress, in loops that the compiler vectorises.

The strain is e = k dev Q with Q = √(FᵀF + w² I), w = WIDTH and k = √(1 + w²). For w = 0 Q is the stretch tensor of the
corotational law, in the frame of the material. The stretch has no derivative where an element is flat; Q has all of
them everywhere, and k makes the slope at rest that of the stretch.

Q follows from its invariants without a principal frame: i₁ is the largest root of (i² − I)² = 4 (II + 2 i₃ i), where I,
II, i₃² are the invariants of Q², and always simple; then Q = (Q² + i₂)⁻¹ (i₁ Q² + i₃) (Hoger and Carlson 1984). As
Q δQ + δQ Q = δ(FᵀF), a stress Σ with respect to Q is P = 2 F Λ with respect to F, where Q Λ + Λ Q = Σ.

A block is an array (9, BLOCK) of F, row by row, or (6, BLOCK) of symmetric matrices: xx, yy, zz, yz, zx, xy; each
column is one element.
"""

import math

import numba
import numpy as np

from palpate.effects.corotational_stress import ARITHMETIC, BLOCK

WIDTH = 0.05
"""w: principal stretches below it count as little more than zero."""
SLOPE = math.sqrt(1.0 + WIDTH**2)
"""k."""
_FEWEST, _MOST = 6, 60
_ROUNDING = 1e-15


@numba.njit(cache=True, error_model="numpy")
def strains(x, tetrahedra, gradients, found):
    """Write the strain of each element at ``x`` (n, 3) [m] into ``found`` (m, 6)."""
    f, q, scratch = np.empty((9, BLOCK)), np.empty((6, BLOCK)), np.empty((4, BLOCK))
    for begin in range(0, len(tetrahedra), BLOCK):
        count = min(BLOCK, len(tetrahedra) - begin)
        stretches(x, tetrahedra, gradients, begin, count, f, q, scratch)
        for k in range(count):
            mean = (q[0, k] + q[1, k] + q[2, k]) / 3.0
            for c in range(6):
                found[begin + k, c] = SLOPE * (q[c, k] - mean if c < 3 else q[c, k])


@numba.njit(cache=True, error_model="numpy")
def energy_and_force(x, tetrahedra, gradients, stiffness, centers, force):
    """Add the nodal forces [N] to ``force`` (n, 3), and return the energy Σ stiffness ‖e − center‖² [J].

    stiffness : (m,) modulus times volume [J]; centers : (m, 6) strains without force
    """
    f, q, scratch = np.empty((9, BLOCK)), np.empty((6, BLOCK)), np.empty((4, BLOCK))
    center, inner = np.empty((6, BLOCK)), np.empty((6, BLOCK))
    stiff, energies, total = np.empty(BLOCK), np.empty(BLOCK), 0.0
    for begin in range(0, len(tetrahedra), BLOCK):
        count = min(BLOCK, len(tetrahedra) - begin)
        for k in range(count):
            stiff[k] = stiffness[begin + k]
            for c in range(6):
                center[c, k] = centers[begin + k, c]
        stretches(x, tetrahedra, gradients, begin, count, f, q, scratch)
        inner_stresses(q, center, stiff, count, energies, inner)
        _stresses(f, inner, count)
        for k in range(count):
            e = begin + k
            total += energies[k]
            for i in range(3):
                p0, p1, p2 = f[3 * i, k], f[3 * i + 1, k], f[3 * i + 2, k]
                for a in range(4):
                    pull = p0 * gradients[e, a, 0] + p1 * gradients[e, a, 1] + p2 * gradients[e, a, 2]
                    force[tetrahedra[e, a], i] -= pull
    return total


@numba.njit(cache=True, error_model="numpy")
def stretches(x, tetrahedra, gradients, begin, count, f, q, scratch):
    """Write F and Q of ``count`` elements from ``begin`` on, and i₁, i₂ and i₃ into rows 0, 2 and 3 of ``scratch``."""
    for k in range(count):
        for i in range(3):
            for j in range(3):
                t = 0.0
                for a in range(4):
                    t += x[tetrahedra[begin + k, a], i] * gradients[begin + k, a, j]
                f[3 * i + j, k] = t
    _squares(f, q, scratch, count)
    for n in range(_MOST):
        if _improve(scratch, count) == count and n >= _FEWEST:
            break
    _roots(q, scratch, count)


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _squares(f, q, scratch, count):
    """Write FᵀF + w² I into ``q``; an upper bound of i₁, and I, II and i₃, into ``scratch``."""
    for k in range(count):
        a = f[0, k] * f[0, k] + f[3, k] * f[3, k] + f[6, k] * f[6, k] + WIDTH**2
        b = f[1, k] * f[1, k] + f[4, k] * f[4, k] + f[7, k] * f[7, k] + WIDTH**2
        c = f[2, k] * f[2, k] + f[5, k] * f[5, k] + f[8, k] * f[8, k] + WIDTH**2
        d = f[1, k] * f[2, k] + f[4, k] * f[5, k] + f[7, k] * f[8, k]
        e = f[2, k] * f[0, k] + f[5, k] * f[3, k] + f[8, k] * f[6, k]
        g = f[0, k] * f[1, k] + f[3, k] * f[4, k] + f[6, k] * f[7, k]
        bc, ca, ab = b * c - d * d, c * a - e * e, a * b - g * g
        third = a * bc + g * (d * e - g * c) + e * (g * d - b * e)
        q[0, k], q[1, k], q[2, k], q[3, k], q[4, k], q[5, k] = a, b, c, d, e, g
        scratch[0, k], scratch[1, k] = math.sqrt(3.0 * (a + b + c)), a + b + c
        scratch[2, k], scratch[3, k] = bc + ca + ab, math.sqrt(max(third, 0.0))


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _improve(scratch, count):
    """Improve i₁ by a step of Newton's method, which comes from above, and return how many had no need of it."""
    settled = 0
    for k in range(count):
        i, away = scratch[0, k], scratch[0, k] * scratch[0, k] - scratch[1, k]
        excess = 0.25 * away * away - scratch[2, k] - 2.0 * scratch[3, k] * i
        step = excess / (i * away - 2.0 * scratch[3, k])
        scratch[0, k] = i - step
        settled += 1 if not step > _ROUNDING * i else 0
    return settled


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _roots(q, scratch, count):
    """Replace the squares in ``q`` by Q = (Q² + i₂)⁻¹ (i₁ Q² + i₃), and II in ``scratch`` by i₂."""
    for k in range(count):
        i1, i3 = scratch[0, k], scratch[3, k]
        i2 = 0.5 * (i1 * i1 - scratch[1, k])
        scratch[2, k] = i2
        a, b, c, d, e, g = q[0, k] + i2, q[1, k] + i2, q[2, k] + i2, q[3, k], q[4, k], q[5, k]
        bc, ca, ab = b * c - d * d, c * a - e * e, a * b - g * g
        ad, be, cg = e * g - a * d, g * d - b * e, d * e - c * g
        # i₁ Q² + i₃ is i₁ (Q² + i₂) + (i₃ − i₁ i₂)
        scale = (i3 - i1 * i2) / (a * bc + g * cg + e * be)
        q[0, k], q[1, k], q[2, k] = i1 + scale * bc, i1 + scale * ca, i1 + scale * ab
        q[3, k], q[4, k], q[5, k] = scale * ad, scale * be, scale * cg


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def inner_stresses(q, center, stiff, count, energies, inner):
    """Write 2 Λ times the volume [J] of each column into ``inner`` (6, BLOCK), and the ``energies`` (BLOCK,) [J]."""
    for k in range(count):
        a, b, c, d, e, g = q[0, k], q[1, k], q[2, k], q[3, k], q[4, k], q[5, k]
        mean = (a + b + c) / 3.0
        sa, sb = SLOPE * (a - mean) - center[0, k], SLOPE * (b - mean) - center[1, k]
        sc, sd = SLOPE * (c - mean) - center[2, k], SLOPE * d - center[3, k]
        se, sg = SLOPE * e - center[4, k], SLOPE * g - center[5, k]
        energies[k] = stiff[k] * (sa * sa + sb * sb + sc * sc + 2.0 * (sd * sd + se * se + sg * sg))
        scale = 4.0 * SLOPE * stiff[k]
        sa, sb, sc, sd, se, sg = scale * sa, scale * sb, scale * sc, scale * sd, scale * se, scale * sg
        inner[0, k], inner[1, k], inner[2, k], inner[3, k], inner[4, k], inner[5, k] = half_root(
            a, b, c, d, e, g, sa, sb, sc, sd, se, sg
        )


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def half_root(a, b, c, d, e, g, sa, sb, sc, sd, se, sg):
    """Return the symmetric X of Q X + X Q = S, from the entries of Q and of S.

    X = Q⁻¹ (S + N) / 2, where N = [n]× makes it symmetric: (i₁ − Q) n is the axis of Q S − S Q.
    """
    # entries zy, xz and yx of Q S − S Q
    t0 = e * sg + d * sb + c * sd - (se * g + sd * b + sc * d)
    t1 = a * se + g * sd + e * sc - (sa * e + sg * d + se * c)
    t2 = g * sa + b * sg + d * se - (sg * a + sb * g + sd * e)
    ta, tb, tc = b + c, c + a, a + b
    bc, ca, ab = tb * tc - d * d, tc * ta - e * e, ta * tb - g * g
    ad, be, cg = e * g + ta * d, g * d + tb * e, d * e + tc * g
    scale = 1.0 / (ta * bc - g * cg - e * be)
    n0 = scale * (bc * t0 + cg * t1 + be * t2)
    n1 = scale * (cg * t0 + ca * t1 + ad * t2)
    n2 = scale * (be * t0 + ad * t1 + ab * t2)
    bc, ca, ab = b * c - d * d, c * a - e * e, a * b - g * g
    ad, be, cg = e * g - a * d, g * d - b * e, d * e - c * g
    scale = 0.5 / (a * bc + g * cg + e * be)
    return (
        scale * (bc * sa + cg * (sg + n2) + be * (se - n1)),
        scale * (cg * (sg - n2) + ca * sb + ad * (sd + n0)),
        scale * (be * (se + n1) + ad * (sd - n0) + ab * sc),
        scale * (cg * (se + n1) + ca * (sd - n0) + ad * sc),
        scale * (be * sa + ad * (sg + n2) + ab * (se - n1)),
        scale * (bc * (sg - n2) + cg * sb + be * (sd + n0)),
    )


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _stresses(f, inner, count):
    """Replace F by the stress with respect to it, times the volume [J]."""
    for i in range(3):
        for k in range(count):
            f0, f1, f2 = f[3 * i, k], f[3 * i + 1, k], f[3 * i + 2, k]
            f[3 * i, k] = f0 * inner[0, k] + f1 * inner[5, k] + f2 * inner[4, k]
            f[3 * i + 1, k] = f0 * inner[5, k] + f1 * inner[1, k] + f2 * inner[3, k]
            f[3 * i + 2, k] = f0 * inner[4, k] + f1 * inner[3, k] + f2 * inner[2, k]
