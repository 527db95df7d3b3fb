"""The volume force of effects/volume.py in the searches' inner loop, where it would be most of the cost."""

import numba
import numpy as np


@numba.njit(cache=True, error_model="numpy")
def add_volume_force(x, tetrahedra, spread, volume, force):
    """Add −κ (L − L₀)(uᵢ − ¼ Σ uⱼ) to ``force`` (n, 3) [N] for ``tetrahedra`` (m, 4) with L₀ ``spread`` (m,) [m].

    The same as the effect's, and twice as fast: nothing is allocated, one root and one division a corner.
    ``volume`` is κ [N/m]. Trap: a corner in the middle of its tetrahedron makes it NaN; the effect takes zero.
    """
    for e in range(len(tetrahedra)):
        a, b, c, d = tetrahedra[e, 0], tetrahedra[e, 1], tetrahedra[e, 2], tetrahedra[e, 3]
        m0 = 0.25 * (x[a, 0] + x[b, 0] + x[c, 0] + x[d, 0])
        m1 = 0.25 * (x[a, 1] + x[b, 1] + x[c, 1] + x[d, 1])
        m2 = 0.25 * (x[a, 2] + x[b, 2] + x[c, 2] + x[d, 2])
        a0, a1, a2, length_a = _from_middle(x, a, m0, m1, m2)
        b0, b1, b2, length_b = _from_middle(x, b, m0, m1, m2)
        c0, c1, c2, length_c = _from_middle(x, c, m0, m1, m2)
        d0, d1, d2, length_d = _from_middle(x, d, m0, m1, m2)
        tension = volume * (length_a + length_b + length_c + length_d - spread[e])
        s0, s1, s2 = 0.25 * (a0 + b0 + c0 + d0), 0.25 * (a1 + b1 + c1 + d1), 0.25 * (a2 + b2 + c2 + d2)
        _pull(force, a, tension, a0 - s0, a1 - s1, a2 - s2)
        _pull(force, b, tension, b0 - s0, b1 - s1, b2 - s2)
        _pull(force, c, tension, c0 - s0, c1 - s1, c2 - s2)
        _pull(force, d, tension, d0 - s0, d1 - s1, d2 - s2)


@numba.njit(cache=True, error_model="numpy")
def _from_middle(x, corner, m0, m1, m2):
    u0, u1, u2 = x[corner, 0] - m0, x[corner, 1] - m1, x[corner, 2] - m2
    length = np.sqrt(u0 * u0 + u1 * u1 + u2 * u2)
    inverse = 1.0 / length
    return u0 * inverse, u1 * inverse, u2 * inverse, length


@numba.njit(cache=True)
def _pull(force, corner, tension, g0, g1, g2):
    force[corner, 0] -= tension * g0
    force[corner, 1] -= tension * g1
    force[corner, 2] -= tension * g2
