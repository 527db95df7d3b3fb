"""A dense closed surface turned into an even one of a wanted number of vertices, of the same topology."""

import heapq

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.surfaces.even_triangulation import flip

ROUNDS = 20
# how far towards the middle of its neighbours a vertex moves in a round
SHIFT = 0.6
# the least cosine between a triangle's normals before and after a collapse
TURN = 0.3


def remesh(start: np.ndarray, corners: np.ndarray, points: np.ndarray, triangles: np.ndarray, count: int):
    """Collapse short edges until ``count`` vertices are left, then even them out on the surface.

    start, corners : the surface to begin with, (k, 3) [m] and (l, 3): a closed manifold of one piece, wound outward
    points, triangles : the same surface, dense enough to be called smooth, (n, 3) [m] and (m, 3)
    Returns the same for the new surface, (count, 3) and (2 count − 4 on a sphere's topology, 3). Collapses that
    would change the topology or fold the surface are left out, so more vertices remain if it cannot be done.
    """
    tree = cKDTree(points)
    dense, normals = points, vertex_normals(points, triangles)
    points, triangles = collapse(start, corners, count)
    for _ in range(ROUNDS):
        triangles = flip(points, triangles)
        moved = _relaxed(points, triangles)
        moved = project(moved, vertex_normals(points, triangles), dense, normals, tree)
        points = _unfolded(points, moved, triangles)
    return points, flip(points, triangles)


def project(points, facing, dense, normals, tree) -> np.ndarray:
    """The place on the dense surface nearest to each point, (n, 3), among those that face the same way.

    Between vertices of the dense surface it is taken as flat: a point moves along the normal of the nearest.
    """
    near = tree.query(points, k=8)[1]
    same = np.einsum("ni,nki->nk", facing, normals[near]) > 0
    nearest = near[np.arange(len(near)), np.argmax(same, axis=1)]
    n = normals[nearest]
    return points - n * np.einsum("ni,ni->n", points - dense[nearest], n)[:, None]


def vertex_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals, weighted by area, (n, 3)."""
    areas = across(points, triangles)
    sums = np.stack([np.bincount(triangles.ravel(), np.repeat(v, 3), len(points)) for v in areas.T], axis=1)
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)


def across(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Normals of triangles, (m, 3), as long as twice their areas."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def collapse(points: np.ndarray, triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Collapse the shortest edge to its middle, again and again, where neither topology nor facing change."""
    points = points.copy()
    fans = [set() for _ in points]
    for triangle in map(tuple, triangles.tolist()):
        for corner in triangle:
            fans[corner].add(triangle)
    left = len(points)
    queue = [_length(points, a, b) for t in triangles.tolist() for a, b in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))]
    queue = [entry for entry in queue if entry[1] < entry[2]]
    heapq.heapify(queue)
    while queue and left > count:
        length, a, b = heapq.heappop(queue)
        stale = not fans[a] or not fans[b] or length != _length(points, a, b)[0]
        if stale or not _joined(fans, a, b) or not _keeps_facing(points, fans, a, b):
            continue
        points[a] = (points[a] + points[b]) / 2
        _merge(fans, a, b)
        left -= 1
        for other in _ring(fans, a):
            heapq.heappush(queue, _length(points, *sorted((a, other))))
    used = np.array([bool(fan) for fan in fans])
    number = np.cumsum(used) - 1
    return points[used], number[np.array(sorted(set().union(*fans)))]


def _length(points, a: int, b: int) -> tuple[float, int, int]:
    x, y, z = points[a] - points[b]
    return x * x + y * y + z * z, a, b


def _ring(fans, a: int) -> set[int]:
    return {corner for triangle in fans[a] for corner in triangle} - {a}


def _joined(fans, a: int, b: int) -> bool:
    """The link condition: an edge's ends share two neighbours only, the corners of its two triangles.

    These lose a triangle each, and must keep four: a vertex of three is a spike.
    """
    shared = _ring(fans, a) & _ring(fans, b)
    return len(fans[a] & fans[b]) == 2 and len(shared) == 2 and min(len(fans[c]) for c in shared) > 4


def _keeps_facing(points, fans, a: int, b: int) -> bool:
    middle = (points[a] + points[b]) / 2
    around = np.array(list(fans[a] ^ fans[b]))
    old = points[around]
    new = np.where(((around == a) | (around == b))[..., None], middle, old)
    before, after = (np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) for p in (old, new))
    sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    # an isosurface has needles of no area to start with, which face nowhere
    return bool((np.einsum("ij,ij->i", before, after) >= TURN * sizes).all())


def _merge(fans, a: int, b: int) -> None:
    """Let ``a`` take the place of ``b``; their two common triangles go."""
    for triangle in fans[a] & fans[b]:
        for corner in triangle:
            fans[corner].discard(triangle)
    for triangle in list(fans[b]):
        moved = tuple(a if corner == b else corner for corner in triangle)
        for corner in triangle:
            fans[corner].discard(triangle)
        for corner in moved:
            fans[corner].add(moved)


def _unfolded(points: np.ndarray, moved: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The moved vertices, (n, 3), but for those of triangles that the move would turn over or press flat."""
    before = across(points, triangles)
    while True:
        after = across(moved, triangles)
        least = TURN * np.einsum("ij,ij->i", before, before)
        bad = np.unique(triangles[np.einsum("ij,ij->i", before, after) < least])
        bad = bad[(moved[bad] != points[bad]).any(axis=1)]
        if not len(bad):
            return moved
        moved[bad] = points[bad]


def _relaxed(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Each vertex moved in its tangent plane towards the mean of its neighbours, (n, 3).

    All neighbours count alike: weights by area would let go of triangles that grow small.
    """
    index, after = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    sums = np.stack([np.bincount(index, column[after], len(points)) for column in points.T], axis=1)
    move = SHIFT * (sums / np.bincount(index)[:, None] - points)
    normals = vertex_normals(points, triangles)
    return points + move - normals * np.einsum("ni,ni->n", move, normals)[:, None]
