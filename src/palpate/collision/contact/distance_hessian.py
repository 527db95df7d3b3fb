"""Second derivatives of the distance of a stencil's two parts."""

import numba
import numpy as np

from palpate.collision.triangles.closest_points import POINT_TRIANGLE, separation


@numba.njit(cache=True, error_model="numpy")
def add_curvature(kind, x, nodes, weights, force, definite, block):
    """Subtract ``force`` ≥ 0 [N] times the Hessian of the distance d from ``block`` (4, 4, 3, 3) [N/m].

    d² /2 is the minimum over the free parameters s of φ = ½ |r|², r = Σ wᵢ(s) xᵢ, so its Hessian is
    φ_xx − φ_xs φ_ss⁻¹ φ_sx for any kind and region. With r's derivatives by s made orthonormal, qₖ, and the weights'
    transformed with them, yₖ, this gives d Hess(d) = w wᵀ⊗(I − n nᵀ) − Σ (w⊗qₖ + yₖ⊗r)(w⊗qₖ + yₖ⊗r)ᵀ.
    With ``definite`` only the positive part is kept: less wwᵀ⊗(I − n nᵀ − Σ qₖqₖᵀ), the positive part of each
    (w⊗qₖ)(yₖ⊗r)ᵀ + (yₖ⊗r)(w⊗qₖ)ᵀ + (yₖ⊗r)(yₖ⊗r)ᵀ, in closed form as w⊗qₖ ⟂ yₖ⊗r.
    """
    q, y = np.empty((2, 3)), np.empty((2, 4))
    free = _free_directions(kind, x, nodes, weights, q, y)
    r = np.array(separation(x, nodes, weights))
    square = np.sum(r * r)
    factor = force / np.sqrt(square)
    if not definite:
        for i in range(3):
            for j in range(3):
                across = (1.0 if i == j else 0.0) - r[i] * r[j] / square
                for a in range(4):
                    for b in range(4):
                        block[a, b, i, j] -= factor * weights[a] * weights[b] * across
    part = np.empty((4, 3))
    for k in range(free):
        first, strength = 1.0, factor
        if definite:
            of_w, of_y = np.sum(weights * weights), np.sum(y[k] * y[k]) * square
            larger = 0.5 * (of_y + np.sqrt(of_y * of_y + 4.0 * of_w * of_y))
            first, strength = of_y / larger, factor * larger * larger / (of_w * of_y + larger * larger) * larger / of_y
        for a in range(4):
            for i in range(3):
                part[a, i] = first * weights[a] * q[k, i] + y[k, a] * r[i]
        add_outer(strength, part, part, block)


@numba.njit(cache=True)
def add_outer(factor, first, second, block):
    """Add ``factor`` times the outer product of ``first`` and ``second`` (4, 3) to ``block`` (4, 4, 3, 3)."""
    for a in range(4):
        for i in range(3):
            scaled = factor * first[a, i]
            for b in range(4):
                for j in range(3):
                    block[a, b, i, j] += scaled * second[b, j]


@numba.njit(cache=True, error_model="numpy")
def _free_directions(kind, x, nodes, weights, q, y):
    """Count the free parameters; write r's derivatives by them, orthonormal, to ``q``, and the weights' to ``y``."""
    free = 0
    if kind == POINT_TRIANGLE:
        first = 1 if weights[1] != 0.0 else 2
        for i in range(first + 1, 4):
            if weights[first] != 0.0 and weights[i] != 0.0:
                y[free] = 0.0
                y[free, first], y[free, i] = 1.0, -1.0
                free += 1
    else:
        for i in range(0, 4, 2):
            if weights[i] != 0.0 and weights[i + 1] != 0.0:
                y[free] = 0.0
                y[free, i], y[free, i + 1] = 1.0, -1.0
                free += 1
    for k in range(free):
        edge = separation(x, nodes, y[k])
        for i in range(3):
            q[k, i] = edge[i]
        if k == 1:
            along = np.sum(q[0] * q[1])
            q[1] -= along * q[0]
            y[1] -= along * y[0]
        length = np.sqrt(np.sum(q[k] * q[k]))
        q[k] /= length
        y[k] /= length
    return free
