"""Bounding volumes: sphere, AABB, OBB, 14-DOP and 18-DOP, one row of numbers each, and their overlap test."""

import numpy as np
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from palpate.collision.trees.fit_volumes import DIRECTIONS, fit_along, fit_dop, fit_obb, fit_sphere
from palpate.collision.trees.volume_overlap import AABB, DOP14, DOP18, OBB, SPHERE, volumes_overlap
from palpate.errors import InputError

KINDS = {"sphere": SPHERE, "aabb": AABB, "obb": OBB, "dop14": DOP14, "dop18": DOP18}
"""Rows: sphere = centre, radius; AABB and k-DOPs = lower bounds along DIRECTIONS[k], then upper ones;
OBB = centre, axes (one after the other), half lengths."""


def fit(kind: str, points: np.ndarray) -> np.ndarray:
    """Fit a volume of ``kind`` around ``points`` (n, 3) [m]: its row [m]; rounding makes it larger, never smaller.

    Sphere: about the middle of the AABB (within √3 of the smallest one). OBB: the axes of the points' covariance, or x,
    y and z if these are better. Raises InputError for an unknown kind, no points, and coordinates that are not finite.
    """
    if kind not in KINDS:
        raise InputError(f"bounding volume {kind} is unknown; name one of {', '.join(KINDS)}.")
    points = np.ascontiguousarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3 or not len(points) or not np.isfinite(points).all():
        raise InputError(f"points of a {kind} must be finite, of shape (n, 3), and at least one; remove the others.")
    row = np.empty({"sphere": 4, "obb": 15}.get(kind) or 2 * len(DIRECTIONS[kind]))
    if kind == "obb":
        fit_obb(points, 0, len(points), row[None], 0)
    else:
        refit(kind, row, points)
    return row


def refit(kind: str, row: np.ndarray, points: np.ndarray) -> None:
    """Refit a row in place to ``points`` (n, 3) [m] that have moved; an OBB keeps its axes, which are expensive."""
    where = (points, 0, len(points))
    if kind == "sphere":
        row[:3] = 0.5 * points.min(axis=0) + 0.5 * points.max(axis=0)
        fit_sphere(*where, row[None], 0)
    elif kind == "obb":
        fit_along(*where, row[3:12].reshape(3, 3).copy(), row[None], 0)
    else:
        fit_dop(*where, DIRECTIONS[kind], row[None], 0)


def overlap(kind: str, a: np.ndarray, b: np.ndarray) -> bool:
    """Test whether the volumes of two rows overlap, touching included; rounding errs towards yes."""
    a, b = np.atleast_2d(a, b)
    return bool(volumes_overlap(KINDS[kind], KINDS[kind], a, b, a, b, 0, 0))


def volume(kind: str, row: np.ndarray) -> float:
    """Compute the volume [m³]."""
    if kind == "sphere":
        return float(4.0 / 3.0 * np.pi * row[3] ** 3)
    if kind == "obb":
        return float(8.0 * row[12:].prod())
    low, high = np.split(row, 2)
    if kind == "aabb" or (low >= high).any():
        return float((high - low).prod()) if kind == "aabb" else 0.0
    # in units of the box, for which Qhull's absolute tolerances are suitable
    middle, half = 0.5 * low[:3] + 0.5 * high[:3], 0.5 * (high[:3] - low[:3])
    normals = DIRECTIONS[kind] * half
    shift = DIRECTIONS[kind] @ middle
    planes = np.vstack([np.column_stack([normals, shift - high]), np.column_stack([-normals, low - shift])])
    planes /= np.linalg.norm(planes[:, :3], axis=1)[:, None]
    corners = HalfspaceIntersection(planes, np.zeros(3)).intersections
    return float(ConvexHull(corners).volume * half.prod())


def tightness(kind: str, points: np.ndarray) -> float:
    """Compute the volume fitted to ``points`` (n, 3) [m] over that of their convex hull: 1 is perfect.

    Infinite where the hull has no volume: fewer than four points, or all in a plane.
    """
    try:
        hull = ConvexHull(points).volume
    except QhullError:
        hull = 0.0
    return volume(kind, fit(kind, points)) / hull if hull > 0.0 else np.inf
