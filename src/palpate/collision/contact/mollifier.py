"""Factor that fades the barrier of edges out as they become parallel, where their distance has a kink."""

import numba
import numpy as np

from palpate.collision.contact.distance_hessian import add_outer
from palpate.collision.triangles.closest_points import EDGE_EDGE
from palpate.collision.triangles.closest_weights import difference, dot


def thresholds(kinds: np.ndarray, nodes: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Compute ε (k,) [m⁴] of each stencil: 10⁻³ of the product of its edges' squared lengths at ``rest`` (n, 3) [m].

    Zero, which means no mollifier, for points and triangles, and for edges of no length.
    Li et al. 2020, supplement, eq. 24.
    """
    first, second = (rest[nodes[:, i + 1]] - rest[nodes[:, i]] for i in (0, 2))
    return np.where(kinds == EDGE_EDGE, 1e-3 * np.sum(first**2, axis=1) * np.sum(second**2, axis=1), 0.0)


@numba.njit(cache=True, error_model="numpy")
def mollifier(x, nodes, threshold, gradient):
    """Compute m(c) = (2 − c/ε) c/ε of edges with c = |u × v|² < ε, else 1, and its first and second derivatives by c.

    gradient : (4, 3), overwritten with c's [m³] where m < 1
    """
    if not threshold > 0.0:
        return 1.0, 0.0, 0.0
    u, v = difference(x, nodes[1], nodes[0]), difference(x, nodes[3], nodes[2])
    cross = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    c = dot(cross, cross) / threshold
    if not c < 1.0:
        return 1.0, 0.0, 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        gradient[1, i] = 2.0 * (v[j] * cross[k] - v[k] * cross[j])
        gradient[3, i] = 2.0 * (cross[j] * u[k] - cross[k] * u[j])
        gradient[0, i], gradient[2, i] = -gradient[1, i], -gradient[3, i]
    return (2.0 - c) * c, 2.0 * (1.0 - c) / threshold, -2.0 / threshold**2


@numba.njit(cache=True)
def add_parallel_curvature(x, nodes, factor, definite, block):
    """Add ``factor`` ≥ 0 times the Hessian of c = |u × v|² to ``block`` (4, 4, 3, 3).

    Twice the square of u × v's first derivatives, which ``definite`` keeps only, and u × v times its second.
    """
    u, v = difference(x, nodes[1], nodes[0]), difference(x, nodes[3], nodes[2])
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    for i in range(3):
        for j in range(3):
            same = 1.0 if i == j else 0.0
            of_u, of_v = vv * same - v[i] * v[j], uu * same - u[i] * u[j]
            mixed = u[i] * v[j] - uv * same
            if not definite:
                mixed += u[i] * v[j] - v[i] * u[j]
            for a in range(2):
                for b in range(2):
                    sign = 2.0 * factor if a == b else -2.0 * factor
                    block[a, b, i, j] += sign * of_u
                    block[2 + a, 2 + b, i, j] += sign * of_v
                    block[a, 2 + b, i, j] += sign * mixed
                    block[2 + b, a, j, i] += sign * mixed


@numba.njit(cache=True, error_model="numpy")
def add_mixed(of_distance, of_both, of_parallel, normals, gradient, definite, block):
    """Add the 2 × 2 matrix [[of_distance, of_both], [of_both, of_parallel]] in the gradients of d and c.

    ``definite`` keeps the matrix's positive part, with each gradient scaled to length one.
    """
    first, second = np.linalg.norm(normals), np.linalg.norm(gradient)
    if not (definite and second > 0.0):
        add_outer(of_distance, normals, normals, block)
        if not definite:
            add_outer(of_both, normals, gradient, block)
            add_outer(of_both, gradient, normals, block)
            add_outer(of_parallel, gradient, gradient, block)
        return
    p, r, s = of_distance * first * first, of_both * first * second, of_parallel * second * second
    mean, half = 0.5 * (p + s), np.hypot(0.5 * (p - s), r)
    for side in (1.0, -1.0):
        value = mean + side * half
        if value > 0.0 and half > 0.0:
            # the eigenvector along the first column of the matrix less the other eigenvalue, or along the second
            other = mean - side * half
            e, f = (p - other, r) if abs(p - other) > abs(s - other) else (r, s - other)
            length = np.hypot(e, f)
            both = e / (length * first) * normals + f / (length * second) * gradient
            add_outer(value, both, both, block)
