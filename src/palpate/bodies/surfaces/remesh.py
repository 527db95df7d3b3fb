"""Triangulation and remeshing of smooth closed surfaces with a given number of evenly spaced vertices."""

import heapq
import math
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

from palpate.bodies.contacts import spread_out
from palpate.bodies.mesh import area_normals, corner_normals
from palpate.bodies.surfaces.triangles import vertex_normals

# weight of a difference of normals against a distance in units of the vertices' mean spacing: keeps the two
# sides of a thin lobe apart
NORMAL_WEIGHT = 0.3
LLOYD_STEPS = 40

# places along an edge whose distance from the surface is compared, the ratio below which an edge is much closer, and
# the angle [rad] that triangles keep
ALONG, DISTANCE_RATIO, LEAST_ANGLE = np.array([[0.25], [0.5], [0.75]]), 0.7, np.radians(22)

_Vector = tuple[float, float, float]
_Edge = tuple[int, int]
_Pair = tuple[list[int], list[int]]


def fibonacci_sphere(count: int) -> np.ndarray:
    """Distribute points evenly over the unit sphere, (count, 3)."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    angle = np.pi * (1 + 5**0.5) * k
    return np.column_stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])


def triangulate(sphere: np.ndarray) -> np.ndarray:
    """Triangulate points on the unit sphere (Delaunay), (2 n - 4, 3), wound outward."""
    triangles = ConvexHull(sphere).simplices.copy()
    inward = np.einsum("ij,ij->i", area_normals(sphere, triangles), sphere[triangles[:, 0]]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles


def triangulate_evenly(
    points: np.ndarray, triangles: np.ndarray, sphere: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Choose ``count`` of the points of a dense surface, evenly by area, and triangulate them.

    points, triangles : the dense surface, (n, 3) [m] and (m, 3), wound outward
    sphere : image of each point on the unit sphere, (n, 3)
    Returns the chosen points' numbers, (count,), and 2 count - 4 triangles of 0 … count - 1, wound outward.
    Centroidal Voronoi cells by Lloyd's steps, starting from farthest points; Delaunay on the sphere gives a closed
    surface with the right counts; edge flips adapt it to the shape, which the map from the sphere may stretch.
    """
    thirds = area_normals(points, triangles) / 6
    area_vectors = np.stack([np.bincount(triangles.ravel(), np.repeat(v, 3), len(points)) for v in thirds.T], axis=1)
    weight = np.linalg.norm(area_vectors, axis=1)
    normals = area_vectors / weight[:, None]
    spacing = np.sqrt(weight.sum() / count)
    features = np.hstack([points / spacing, NORMAL_WEIGHT * normals])
    centres = features[[0, *spread_out(features, features[:1], count - 1)]]
    for _ in range(LLOYD_STEPS):
        nearest_centre = cKDTree(centres).query(features)[1]
        moments = [np.bincount(nearest_centre, weight * column, count) for column in features.T]
        centres = np.column_stack(moments) / np.bincount(nearest_centre, weight, count)[:, None]
    chosen = cKDTree(features).query(centres)[1]
    return chosen, flip(points[chosen], triangulate(sphere[chosen]))


def flip(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Flip edges while that raises the smaller of the two triangles' smallest angles."""
    places = points.tolist()

    def better(_: _Edge, pair: _Pair, __: _Edge, flipped: _Pair) -> bool:
        # terminates, since the sorted list of smallest angles only grows; the margin covers rounding
        return _smallest_angle(places, flipped) > _smallest_angle(places, pair) + 1e-3

    return _flip_where(points, triangles, better)


def flip_onto(points: np.ndarray, triangles: np.ndarray, distance: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Flip edges that cut across a groove or a ridge, where the other diagonal is much closer to the surface.

    distance : a function from places (k, 3) [m] to their distances (k,) [m] from the surface
    """
    places, distances = points.tolist(), dict[_Edge, float]()

    def away(a: int, b: int) -> float:
        key = (min(a, b), max(a, b))
        if key not in distances:
            distances[key] = float(distance(points[a] + ALONG * (points[b] - points[a])).max())
        return distances[key]

    def better(edge: _Edge, pair: _Pair, diagonal: _Edge, flipped: _Pair) -> bool:
        # terminates, since the sum of the distances only falls
        if away(*diagonal) > DISTANCE_RATIO * away(*edge):
            return False
        return _smallest_angle(places, flipped) >= min(LEAST_ANGLE, _smallest_angle(places, pair))

    return _flip_where(points, triangles, better)


def _flip_where(
    points: np.ndarray, triangles: np.ndarray, better: Callable[[_Edge, _Pair, _Edge, _Pair], bool]
) -> np.ndarray:
    """Flip edges between two triangles where ``better`` says so, and where that makes neither folds nor spikes.

    better : takes an edge, its two triangles, the other diagonal, and the two triangles after the flip
    """
    valence = np.bincount(triangles.ravel())
    places: list[list[float]] = points.tolist()
    triangles = triangles.tolist()
    owner = {(t[i - 1], t[i]): k for k, t in enumerate(triangles) for i in range(3)}
    queue = deque(edge for edge in owner if edge[0] < edge[1])
    while queue:
        a, b = queue.popleft()
        if (a, b) not in owner:
            continue
        one, other = owner[a, b], owner[b, a]
        c = next(p for p in triangles[one] if p not in (a, b))
        d = next(p for p in triangles[other] if p not in (a, b))
        old, new = (triangles[one], triangles[other]), ([c, a, d], [d, b, c])
        # a vertex of three triangles is a spike, which later moves could flatten
        spike = min(valence[a], valence[b]) <= 4
        if spike or (c, d) in owner or (d, c) in owner or not better((a, b), old, (c, d), new) or _folded(places, new):
            continue
        valence[[a, b]] -= 1
        valence[[c, d]] += 1
        del owner[a, b], owner[b, a]
        triangles[one], triangles[other] = new
        owner |= {(t[i - 1], t[i]): k for k, t in zip((one, other), new, strict=True) for i in range(3)}
        queue += [(a, d), (d, b), (b, c), (c, a)]
    return np.array(triangles)


def _smallest_angle(points: list[list[float]], triangles: Sequence[list[int]]) -> float:
    """Compute the smallest angle of some triangles [rad]; in plain numbers, as arrays are slow for so few."""
    smallest = math.inf
    for triangle in triangles:
        for i in range(3):
            o, p, q = points[triangle[i]], points[triangle[i - 2]], points[triangle[i - 1]]
            u, v = (p[0] - o[0], p[1] - o[1], p[2] - o[2]), (q[0] - o[0], q[1] - o[1], q[2] - o[2])
            n = _cross(u, v)
            length = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
            smallest = min(smallest, math.atan2(length, u[0] * v[0] + u[1] * v[1] + u[2] * v[2]))
    return smallest


def _folded(points: list[list[float]], triangles: Sequence[list[int]]) -> bool:
    """Test whether two triangles form a sharp fold (normals more than about 78° apart)."""
    normals = []
    for triangle in triangles:
        a, b, c = (points[corner] for corner in triangle)
        normals.append(_cross((b[0] - a[0], b[1] - a[1], b[2] - a[2]), (c[0] - a[0], c[1] - a[1], c[2] - a[2])))
    n, m = normals
    return _dot(n, m) < 0.2 * math.sqrt(_dot(n, n)) * math.sqrt(_dot(m, m))


def _cross(u: _Vector, v: _Vector) -> _Vector:
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


def _dot(u: _Vector, v: _Vector) -> float:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


ROUNDS = 20
# fraction of the way to the mean of its neighbours that a vertex moves in a round
RELAXATION = 0.6
Fans = list[set[tuple[int, ...]]]
"""The triangles around each vertex."""
# the least cosine between a triangle's normals before and after a collapse
LEAST_COSINE = 0.3


def remesh(
    start: np.ndarray, corners: np.ndarray, points: np.ndarray, triangles: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Collapse short edges until ``count`` vertices are left, then space them evenly on the surface.

    start, corners : the surface to begin with, (k, 3) [m] and (l, 3): a closed manifold of one piece, wound outward
    points, triangles : the same surface, dense enough to count as smooth, (n, 3) [m] and (m, 3)
    Returns points and triangles of the new surface, (count, 3) and, with a sphere's topology, (2 count − 4, 3).
    Collapses that would change the topology or fold the surface are skipped, so more vertices may remain.
    """
    tree = cKDTree(points)
    dense, normals = points, vertex_normals(points, triangles)
    points, triangles = collapse(start, corners, count)
    for _ in range(ROUNDS):
        triangles = flip(points, triangles)
        moved = smooth_tangentially(points, triangles)
        moved = project(moved, vertex_normals(points, triangles), dense, normals, tree)
        points = undo_folds(points, moved, triangles)
    return points, flip(points, triangles)


def project(
    points: np.ndarray, facing: np.ndarray, dense: np.ndarray, normals: np.ndarray, tree: cKDTree
) -> np.ndarray:
    """Project points, (n, 3), to the nearest place of the dense surface that faces the same way.

    The dense surface is taken as flat around each of its vertices: a point moves along the normal of the nearest one.
    """
    nearest = nearest_alike(points, facing, normals, tree)
    n = normals[nearest]
    return points - n * np.einsum("ni,ni->n", points - dense[nearest], n)[:, None]


def nearest_alike(points: np.ndarray, facing: np.ndarray, normals: np.ndarray, tree: cKDTree) -> np.ndarray:
    """Return the vertex (n,) of a dense surface that is nearest to each point (n, 3) and faces the same way.

    facing, normals : of the points and of the vertices; if none of the eight nearest faces so, the nearest is taken
    """
    near = tree.query(points, k=8)[1]
    alike = np.einsum("ni,nki->nk", facing, normals[near]) > 0
    return near[np.arange(len(near)), np.argmax(alike, axis=1)]


def collapse(points: np.ndarray, triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Collapse the shortest edge to its midpoint, repeatedly, where neither topology nor orientation changes."""
    points = points.copy()
    fans: Fans = [set() for _ in points]
    for triangle in map(tuple, triangles.tolist()):
        for corner in triangle:
            fans[corner].add(triangle)
    vertices_left = len(points)
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    queue = [_queue_entry(points, a, b) for a, b in edges.tolist() if a < b]
    heapq.heapify(queue)
    while queue and vertices_left > count:
        length, a, b = heapq.heappop(queue)
        stale = not fans[a] or not fans[b] or length != _queue_entry(points, a, b)[0]
        if stale or not _keeps_topology(fans, a, b) or not _keeps_facing(points, fans, a, b):
            continue
        points[a] = (points[a] + points[b]) / 2
        _merge_vertices(fans, a, b)
        vertices_left -= 1
        for other in _one_ring(fans, a):
            heapq.heappush(queue, _queue_entry(points, *sorted((a, other))))
    used = np.array([bool(fan) for fan in fans])
    new_number = np.cumsum(used) - 1
    return points[used], new_number[np.array(sorted(set().union(*fans)))]


def _queue_entry(points: np.ndarray, a: int, b: int) -> tuple[float, int, int]:
    x, y, z = points[a] - points[b]
    return x * x + y * y + z * z, a, b


def _one_ring(fans: Fans, a: int) -> set[int]:
    return {corner for triangle in fans[a] for corner in triangle} - {a}


def _keeps_topology(fans: Fans, a: int, b: int) -> bool:
    """Test the link condition: an edge's ends share only two neighbours, the third corners of its two triangles.

    These lose a triangle each, and must keep four: a vertex of three is a spike.
    """
    shared = _one_ring(fans, a) & _one_ring(fans, b)
    return len(fans[a] & fans[b]) == 2 and len(shared) == 2 and min(len(fans[c]) for c in shared) > 4


def _keeps_facing(points: np.ndarray, fans: Fans, a: int, b: int) -> bool:
    """Test whether no triangle around an edge a b would turn over if the edge were collapsed to its midpoint."""
    middle = (points[a] + points[b]) / 2
    changed = np.array(list(fans[a] ^ fans[b]))
    corners = points[changed]
    new_corners = np.where(((changed == a) | (changed == b))[..., None], middle, corners)
    before, after = corner_normals(corners), corner_normals(new_corners)
    sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    # an isosurface contains needles of zero area, which have no normal
    return bool((np.einsum("ij,ij->i", before, after) >= LEAST_COSINE * sizes).all())


def _merge_vertices(fans: Fans, a: int, b: int) -> None:
    """Replace vertex ``b`` by ``a``; their two common triangles disappear."""
    for triangle in fans[a] & fans[b]:
        for corner in triangle:
            fans[corner].discard(triangle)
    for triangle in list(fans[b]):
        moved = tuple(a if corner == b else corner for corner in triangle)
        for corner in triangle:
            fans[corner].discard(triangle)
        for corner in moved:
            fans[corner].add(moved)


def undo_folds(points: np.ndarray, moved: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the moved vertices, (n, 3), without the moves that would invert or flatten a triangle."""
    before = area_normals(points, triangles)
    while True:
        after = area_normals(moved, triangles)
        smallest = LEAST_COSINE * np.einsum("ij,ij->i", before, before)
        bad = np.unique(triangles[np.einsum("ij,ij->i", before, after) < smallest])
        bad = bad[(moved[bad] != points[bad]).any(axis=1)]
        if not len(bad):
            return moved
        moved[bad] = points[bad]


def smooth_tangentially(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Move each vertex in its tangent plane towards the mean of its neighbours, (n, 3).

    All neighbours have equal weight: with weights by area, triangles that become small would keep shrinking.
    """
    corners, next_corners = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    sums = np.stack([np.bincount(corners, column[next_corners], len(points)) for column in points.T], axis=1)
    move = RELAXATION * (sums / np.bincount(corners)[:, None] - points)
    normals = vertex_normals(points, triangles)
    return points + move - normals * np.einsum("ni,ni->n", move, normals)[:, None]
