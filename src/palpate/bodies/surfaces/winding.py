"""Inside and outside of triangles that may have holes, overlaps and triangles that meet in threes."""

import numpy as np


def winding_numbers(
    points: np.ndarray, triangles: np.ndarray, origin: np.ndarray, spacing: float, shape: tuple[int, int, int]
) -> np.ndarray:
    """Estimate how often the triangles wind around each place of a grid, (nz, ny, nx): 1 inside, 0 outside.

    points, triangles : (n, 3) and (m, 3), wound outward
    origin, spacing, shape : first place (x, y, z), distance between places, numbers of places along z, y and x

    The mean of the signed crossings of six rays, along both senses of each axis (the generalised winding number of
    Jacobson, Kavan and Sorkine-Hornung 2013 is the mean of all rays). Where the surface is closed, all six agree; a ray
    that leaves through a hole is outvoted by the others. Where parts overlap, it is 2.
    """
    total = np.zeros(shape, dtype=np.float32)
    grid = (np.asarray(points) - origin) / spacing
    for axis in range(3):
        order = [(axis + 1) % 3, (axis + 2) % 3, axis]
        counts = _along(grid[:, order], triangles, [shape[2 - a] for a in order])
        total += counts.transpose([order.index(a) for a in (2, 1, 0)]) / 3
    return total


def _along(points: np.ndarray, triangles: np.ndarray, sizes: list[int]) -> np.ndarray:
    """Compute the mean count of the two rays along the last axis, for each place, (u, v, w)."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    # twice the area seen along the ray, positive where the triangle faces it
    twice = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    corners = np.stack([a, b, c])
    # places are at whole numbers, moved a little so that no ray meets an edge or a corner
    shift = np.array([0.000314159, 0.000271828])
    low = np.clip(np.ceil(corners[:, :, :2].min(axis=0) - shift), 0, None).astype(np.int64)
    high = np.minimum(np.floor(corners[:, :, :2].max(axis=0) - shift), np.array(sizes[:2]) - 1).astype(np.int64)
    wide = np.clip(high - low + 1, 0, None)
    wide[twice == 0] = 0
    rays = wide.prod(axis=1)
    which = np.repeat(np.arange(len(triangles)), rays)
    number = np.arange(len(which)) - np.repeat(np.cumsum(rays) - rays, rays)
    u = low[which, 0] + number // wide[which, 1]
    v = low[which, 1] + number % wide[which, 1]
    at = np.column_stack([u, v]) + shift
    weights = np.stack([_twice_area(p[which], q[which], at) for p, q in ((b, c), (c, a), (a, b))]) / twice[which]
    inside = (weights > 0).all(axis=0)
    which, u, v, weights = which[inside], u[inside], v[inside], weights[:, inside]
    height = (weights * corners[:, which, 2]).sum(axis=0)
    crossings = np.zeros((sizes[0], sizes[1], sizes[2] + 1), dtype=np.float32)
    # a ray leaves through a triangle that faces along it
    places = u, v, np.clip(np.ceil(height), 0, sizes[2]).astype(np.int64)
    np.add.at(crossings, places, -np.sign(twice[which]).astype(np.float32))
    return (np.cumsum(crossings, axis=2) - crossings.sum(axis=2, keepdims=True) / 2)[:, :, :-1]


def _twice_area(p: np.ndarray, q: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Compute twice the signed area, seen along the ray, of the triangles of an edge and a place, (n,)."""
    return (q[:, 0] - p[:, 0]) * (at[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (at[:, 0] - p[:, 0])
