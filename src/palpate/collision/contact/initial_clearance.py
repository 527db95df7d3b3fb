"""Check that a scene begins without overlap, since an initial overlap has no defined direction of separation."""

import numpy as np

from palpate.collision.contact.proximity import NearStencils
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import crossing_pairs
from palpate.errors import InputError

LEAST_CLEARANCE = 1e-8
"""Clearance, relative to the gap, below which surfaces count as touching: the barrier's forces would be too large."""


def check_apart(
    points: np.ndarray,
    surfaces: list[np.ndarray],
    names: list[str],
    can_touch: np.ndarray,
    is_floor: np.ndarray,
    near: NearStencils,
) -> None:
    """Raise InputError, with their names, if two surfaces that can touch do so, or if one is inside another.

    points : (n, 3) [m]; surfaces : triangles (m, 3) of each; can_touch : (p, p) bool, which pairs can touch, on the
    diagonal which can touch themselves; is_floor : (p,) bool, which have an inside although they are open; near : the
    stencils that may touch
    """
    trees = [Tree(points, triangles) for triangles in surfaces]
    for i, j in np.argwhere(np.triu(can_touch)):
        if i == j:
            if len(crossing_pairs(trees[i])[0]):
                raise InputError(f"{names[i]} intersects itself where the scene begins; choose another start.")
            continue
        if len(crossing_pairs(trees[i], trees[j])[0]):
            raise InputError(f"{names[i]} intersects {names[j]} where the scene begins; move them apart.")
        for inner, outer in ((i, j), (j, i)):
            inside = winding_number(points[surfaces[inner][0, 0]], points[surfaces[outer]])
            if inside > (0.0 if is_floor[outer] else 0.5):
                raise InputError(f"{names[inner]} is inside {names[outer]} where the scene begins; move it out.")
    touching = np.flatnonzero(near.clearances(points) <= LEAST_CLEARANCE * near.gap)
    if len(touching):
        first, second = (names[i] for i in sorted(near.pieces[touching[0]]))
        raise InputError(f"{first} and {second} touch where the scene begins; move them apart.")


def winding_number(point: np.ndarray, corners: np.ndarray) -> float:
    """Compute how often triangles (m, 3, 3) [m], wound outward, enclose ``point`` (3,) [m]: 1 inside, 0 outside.

    The sum of their solid angles over 4π (van Oosterom and Strackee 1983).
    """
    a, b, c = (corners[:, i] - point for i in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    cosines = la * lb * lc + lc * np.sum(a * b, axis=1) + lb * np.sum(a * c, axis=1) + la * np.sum(b * c, axis=1)
    return float(np.arctan2(triple, cosines).sum() / (2.0 * np.pi))
