"""Remeshing of a dense closed surface to a given number of evenly spaced vertices, with the same topology."""

import heapq

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.surfaces.even_triangulation import flip

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


def vertex_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Compute unit normals, weighted by area, (n, 3)."""
    areas = area_normals(points, triangles)
    sums = np.stack([np.bincount(triangles.ravel(), np.repeat(v, 3), len(points)) for v in areas.T], axis=1)
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)


def area_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Compute normals of triangles, (m, 3), whose length is twice the triangle's area."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def collapse(points: np.ndarray, triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Collapse the shortest edge to its midpoint, repeatedly, where neither topology nor orientation changes."""
    points = points.copy()
    fans: Fans = [set() for _ in points]
    for triangle in map(tuple, triangles.tolist()):
        for corner in triangle:
            fans[corner].add(triangle)
    left = len(points)
    queue = [
        _queue_entry(points, a, b) for t in triangles.tolist() for a, b in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))
    ]
    queue = [entry for entry in queue if entry[1] < entry[2]]
    heapq.heapify(queue)
    while queue and left > count:
        length, a, b = heapq.heappop(queue)
        stale = not fans[a] or not fans[b] or length != _queue_entry(points, a, b)[0]
        if stale or not _keeps_topology(fans, a, b) or not _keeps_facing(points, fans, a, b):
            continue
        points[a] = (points[a] + points[b]) / 2
        _merge_vertices(fans, a, b)
        left -= 1
        for other in _one_ring(fans, a):
            heapq.heappush(queue, _queue_entry(points, *sorted((a, other))))
    used = np.array([bool(fan) for fan in fans])
    number = np.cumsum(used) - 1
    return points[used], number[np.array(sorted(set().union(*fans)))]


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
    middle = (points[a] + points[b]) / 2
    around = np.array(list(fans[a] ^ fans[b]))
    old = points[around]
    new = np.where(((around == a) | (around == b))[..., None], middle, old)
    before, after = (np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) for p in (old, new))
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
        least = LEAST_COSINE * np.einsum("ij,ij->i", before, before)
        bad = np.unique(triangles[np.einsum("ij,ij->i", before, after) < least])
        bad = bad[(moved[bad] != points[bad]).any(axis=1)]
        if not len(bad):
            return moved
        moved[bad] = points[bad]


def smooth_tangentially(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Move each vertex in its tangent plane towards the mean of its neighbours, (n, 3).

    All neighbours have equal weight: with weights by area, triangles that become small would keep shrinking.
    """
    index, after = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    sums = np.stack([np.bincount(index, column[after], len(points)) for column in points.T], axis=1)
    move = RELAXATION * (sums / np.bincount(index)[:, None] - points)
    normals = vertex_normals(points, triangles)
    return points + move - normals * np.einsum("ni,ni->n", move, normals)[:, None]
