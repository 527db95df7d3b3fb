"""The barrier that keeps surfaces apart: an energy that acts within a gap and diverges as it closes (Li et al. 2020).

It acts on stencils, a point and a triangle or two edges, which are listed once each from pairs of triangles. A
mollifier fades it out as edges become parallel, where their distance has a kink.
"""

import numba
import numpy as np
from scipy import sparse

from palpate.collision.triangles.closest_points import (
    EDGE_EDGE,
    POINT_TRIANGLE,
    boxes_apart,
    closest,
    difference,
    dot,
    separation,
)


class Surface:
    """Triangles, each vertex and each edge of which is owned by one of them (Curtis, Tamstorf and Manocha 2008).

    nodes : (m, 3) int64, the triangles
    vertices, edges : (m, 3) bool, whether a triangle owns its i-th vertex, its edge from the i-th to the next
    A triangle (p, p, p) is a point and has one vertex, (p, q, q) is a segment and has two vertices and one edge.
    """

    def __init__(self, triangles: np.ndarray):
        self.nodes = np.ascontiguousarray(triangles, dtype=np.int64)
        self.vertices = _first_occurrences(self.nodes.ravel()).reshape(-1, 3)
        after = np.roll(self.nodes, -1, axis=1)
        low, high = np.minimum(self.nodes, after), np.maximum(self.nodes, after)
        owned = _first_occurrences((low * (high.max(initial=0) + 1) + high).ravel()).reshape(-1, 3)
        self.edges = owned & (low != high)


def stencils(first: Surface, second: Surface, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """List kinds (k,) and nodes (k, 4) of the stencils of ``pairs`` (p, 2) of triangles of two surfaces, or of one.

    Each vertex with each triangle, either way, and each edge with each edge, through the triangles that own them;
    none that share a node. A triangle that is a point touches only another's points: others have it as their vertex.
    Trap: within one surface, parts that a triangle owns can come near an adjacent triangle, so ``pairs`` must include
    ``adjacent_pairs``, which trees leave out.
    """
    pairs = np.ascontiguousarray(pairs, dtype=np.int64).reshape(-1, 2)
    return _stencils(first.nodes, first.vertices, first.edges, second.nodes, second.vertices, second.edges, pairs)


def adjacent_pairs(triangles: np.ndarray) -> np.ndarray:
    """List pairs i < j (p, 2) of ``triangles`` (m, 3) that share a node but are not one triangle twice, sorted."""
    cells, count = np.repeat(np.arange(len(triangles)), 3), int(triangles.max(initial=-1)) + 1
    corners = sparse.csr_array((np.ones(len(cells)), (cells, triangles.ravel())), shape=(len(triangles), count))
    shared = sparse.triu(corners @ corners.T, k=1).tocoo()
    return np.unique(np.column_stack(shared.coords), axis=0).astype(np.int64)


def _first_occurrences(keys):
    """Mark the entries of ``keys`` (n,) that are the first of their value."""
    owned = np.zeros(len(keys), dtype=bool)
    owned[np.unique(keys, return_index=True)[1]] = True
    return owned


@numba.njit(cache=True)
def _stencils(nodes_a, vertices_a, edges_a, nodes_b, vertices_b, edges_b, pairs):
    # a pair has at most 3 + 3 points with a triangle and 9 pairs of edges; the actual ones are counted first
    count, kinds, nodes = 0, np.empty(0, np.int64), np.empty((0, 4), np.int64)
    for fill in (False, True):
        if fill:
            kinds, nodes, count = np.empty(count, np.int64), np.empty((count, 4), np.int64), 0
        for k in range(len(pairs)):
            i, j = pairs[k]
            count = _points(nodes_a[i], vertices_a[i], nodes_b[j], False, fill, count, kinds, nodes)
            count = _points(nodes_b[j], vertices_b[j], nodes_a[i], True, fill, count, kinds, nodes)
            count = _edges(nodes_a[i], edges_a[i], nodes_b[j], edges_b[j], fill, count, kinds, nodes)
    return kinds, nodes


@numba.njit(cache=True)
def _points(triangle, owned, other, swapped, fill, count, kinds, nodes):
    """Write the stencils of owned vertices of ``triangle`` with the triangle ``other``; return the new count.

    fill : False only counts; swapped : whether this is the second call for a pair. An ``other`` that is a point is left
    to the call in which it is the vertex; two points are listed in the first call.
    """
    if other[0] == other[1] == other[2] and (swapped or not triangle[0] == triangle[1] == triangle[2]):
        return count
    for i in range(3):
        p = triangle[i]
        if owned[i] and p != other[0] and p != other[1] and p != other[2]:
            if fill:
                kinds[count], nodes[count, 0] = POINT_TRIANGLE, p
                nodes[count, 1:] = other
            count += 1
    return count


@numba.njit(cache=True)
def _edges(triangle, owned, other, owned_other, fill, count, kinds, nodes):
    """Write the stencils of pairs of owned edges of two triangles that share no node; return the new count."""
    for i in range(3):
        a, b = triangle[i], triangle[(i + 1) % 3]
        for j in range(3):
            c, d = other[j], other[(j + 1) % 3]
            if owned[i] and owned_other[j] and a != c and a != d and b != c and b != d:
                if fill:
                    kinds[count] = EDGE_EDGE
                    nodes[count, 0], nodes[count, 1], nodes[count, 2], nodes[count, 3] = a, b, c, d
                count += 1
    return count


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
    vector = np.empty((4, 3))
    for k in range(free):
        w_factor, scale = 1.0, factor
        if definite:
            of_w, of_y = np.sum(weights * weights), np.sum(y[k] * y[k]) * square
            larger = 0.5 * (of_y + np.sqrt(of_y * of_y + 4.0 * of_w * of_y))
            w_factor, scale = of_y / larger, factor * larger * larger / (of_w * of_y + larger * larger) * larger / of_y
        for a in range(4):
            for i in range(3):
                vector[a, i] = w_factor * weights[a] * q[k, i] + y[k, a] * r[i]
        add_outer(scale, vector, vector, block)


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
        corner = 1 if weights[1] != 0.0 else 2
        for i in range(corner + 1, 4):
            if weights[corner] != 0.0 and weights[i] != 0.0:
                y[free] = 0.0
                y[free, corner], y[free, i] = 1.0, -1.0
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


def thresholds(kinds: np.ndarray, nodes: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Return ε (k,) [m⁴] of the mollifier: 10⁻³ of the product of both edges' squared lengths at ``rest`` (n, 3) [m].

    It is zero, which means no mollifier, for a point and a triangle, and for edges of no length (Li et al. 2020,
    supplement, eq. 24).
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

    For edges u and v: twice the square of the first derivatives of u × v (``definite``: only these), and its second.
    """
    u, v = difference(x, nodes[1], nodes[0]), difference(x, nodes[3], nodes[2])
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    for i in range(3):
        for j in range(3):
            unit = 1.0 if i == j else 0.0
            of_u, of_v = vv * unit - v[i] * v[j], uu * unit - u[i] * u[j]
            mixed = u[i] * v[j] - uv * unit
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
    length_d, length_c = np.linalg.norm(normals), np.linalg.norm(gradient)
    if not (definite and length_c > 0.0):
        add_outer(of_distance, normals, normals, block)
        if not definite:
            add_outer(of_both, normals, gradient, block)
            add_outer(of_both, gradient, normals, block)
            add_outer(of_parallel, gradient, gradient, block)
        return
    p, r, s = of_distance * length_d * length_d, of_both * length_d * length_c, of_parallel * length_c * length_c
    mean, half = 0.5 * (p + s), np.hypot(0.5 * (p - s), r)
    for side in (1.0, -1.0):
        value = mean + side * half
        if value > 0.0 and half > 0.0:
            # the eigenvector along the first column of the matrix less the other eigenvalue, or along the second
            other = mean - side * half
            along_d, along_c = (p - other, r) if abs(p - other) > abs(s - other) else (r, s - other)
            length = np.hypot(along_d, along_c)
            vector = along_d / (length * length_d) * normals + along_c / (length * length_c) * gradient
            add_outer(value, vector, vector, block)


@numba.njit(cache=True, error_model="numpy")
def barrier(s):
    """Compute b(s) = −(s − 1)² ln s for 0 < s < 1, and its first two derivatives (Li et al. 2020, eq. 6)."""
    log, rest = np.log(s), s - 1.0
    return -rest * rest * log, -2.0 * rest * log - rest * rest / s, -2.0 * log - 4.0 * rest / s + (rest / s) ** 2


@numba.njit(cache=True)
def energy(kinds, nodes, offsets, scales, mollify, gap, x):
    """Return Σ scale · gap · m · b((d − offset)/gap) [J] over stencils with clearance d − offset below ``gap`` [m].

    kinds : (k,) of POINT_TRIANGLE or EDGE_EDGE; nodes : (k, 4); offsets : (k,) [m] sums of the parts' radii;
    scales : (k,) [N]; mollify : (k,) [m⁴] from ``thresholds``; x : (n, 3) [m]
    It is infinite where parts touch or overlap (Li et al. 2020, eq. 5, with an argument over the gap, so that a force
    has the size of ``scale``). Trap: the energy of parallel edges is zero at any distance; their ends are kept from the
    triangles beside the other edge, so pass both kinds of stencils.
    """
    weights, gradient, total = np.empty(4), np.empty((4, 3)), 0.0
    for k in range(len(kinds)):
        if boxes_apart(kinds[k], x, nodes[k], offsets[k] + gap):
            continue
        s = (closest(kinds[k], x, nodes[k], weights)[0] - offsets[k]) / gap
        if s >= 1.0:
            continue
        if not s > 0.0:
            return np.inf
        total += scales[k] * gap * mollifier(x, nodes[k], mollify[k], gradient)[0] * barrier(s)[0]
    return total


@numba.njit(cache=True)
def add_force(kinds, nodes, offsets, scales, mollify, gap, x, force):
    """Add minus the gradient of ``energy`` to ``force`` (n, 3) [N]; zero of parts that touch or overlap."""
    weights, gradient = np.empty(4), np.empty((4, 3))
    for k in range(len(kinds)):
        if boxes_apart(kinds[k], x, nodes[k], offsets[k] + gap):
            continue
        distance, _ = closest(kinds[k], x, nodes[k], weights)
        s = (distance - offsets[k]) / gap
        if not 0.0 < s < 1.0:
            continue
        factor, by_c, _ = mollifier(x, nodes[k], mollify[k], gradient)
        value, slope, _ = barrier(s)
        r = separation(x, nodes[k], weights)
        push = -scales[k] * factor * slope / distance
        for a in range(4):
            for i in range(3):
                force[nodes[k, a], i] += push * weights[a] * r[i]
                if by_c != 0.0:
                    force[nodes[k, a], i] -= scales[k] * gap * value * by_c * gradient[a, i]


@numba.njit(cache=True)
def blocks(kinds, nodes, offsets, scales, mollify, gap, x, definite):
    """Find the active stencils, (a,), and the energy's second derivatives by their nodes, (a, 4, 4, 3, 3) [N/m].

    The exact Hessian; with ``definite`` a positive semi-definite part of it, which lacks only negative terms.
    Where a row of ``nodes`` has a node twice, the blocks of both places belong to it.
    """
    weights, active, ratios = np.empty((len(kinds), 4)), np.empty(len(kinds), np.int64), np.empty(len(kinds))
    count = 0
    for k in range(len(kinds)):
        if boxes_apart(kinds[k], x, nodes[k], offsets[k] + gap):
            continue
        distance, _ = closest(kinds[k], x, nodes[k], weights[count])
        s = (distance - offsets[k]) / gap
        if 0.0 < s < 1.0:
            active[count], ratios[count] = k, s
            count += 1
    hessians = np.zeros((count, 4, 4, 3, 3))
    for a in range(count):
        k = active[a]
        _add_hessian(kinds[k], nodes[k], scales[k], mollify[k], gap, x, weights[a], ratios[a], definite, hessians[a])
    return active[:count], hessians


@numba.njit(cache=True, error_model="numpy")
def _add_hessian(kind, nodes, scale, mollify, gap, x, weights, s, definite, block):
    """Add the Hessian of scale · gap · m(c) · b(s), s = (d − offset)/gap, of one stencil to ``block`` (4, 4, 3, 3).

    by_c, by_cc : m′ and m″; slope, curvature : b′ and b″. As b′ < 0, −scale · m · b′ is the push [N] between its parts.
    """
    gradient, normals = np.empty((4, 3)), np.empty((4, 3))
    factor, by_c, by_cc = mollifier(x, nodes, mollify, gradient)
    value, slope, curvature = barrier(s)
    r = np.array(separation(x, nodes, weights))
    r /= np.sqrt(np.sum(r * r))
    for a in range(4):
        normals[a] = weights[a] * r
    add_curvature(kind, x, nodes, weights, -scale * factor * slope, definite, block)
    if by_cc == 0.0:
        add_outer(scale * curvature / gap, normals, normals, block)
        return
    of_both, of_parallel = scale * slope * by_c, scale * gap * value * by_cc
    add_mixed(scale * factor * curvature / gap, of_both, of_parallel, normals, gradient, definite, block)
    add_parallel_curvature(x, nodes, scale * gap * value * by_c, definite, block)
