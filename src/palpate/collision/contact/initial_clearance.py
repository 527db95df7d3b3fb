"""Find what overlaps where a scene begins, since an initial overlap has no defined direction of separation."""

from dataclasses import dataclass

import numpy as np

from palpate.collision.contact.proximity import NearStencils
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import crossing_pairs

LEAST_CLEARANCE = 1e-8
"""Clearance, relative to the gap, below which surfaces count as touching: the barrier's forces would be too large."""


@dataclass(frozen=True)
class Overlap:
    """Two surfaces, ``first`` and ``second``, that overlap, and how: one of WORDS."""

    first: int
    second: int
    how: str


WORDS = {
    "itself": "{0} intersects itself where the scene begins; choose another start.",
    "cross": "{0} intersects {1} where the scene begins; move them apart.",
    "inside": "{0} is inside {1} where the scene begins; move it out.",
    "touch": "{0} and {1} touch where the scene begins; move them apart.",
}
"""Each way to overlap in a sentence with the names of both surfaces."""


def describe(found: Overlap, names: list[str]) -> str:
    """Return the sentence of an overlap."""
    return WORDS[found.how].format(names[found.first], names[found.second])


def first_overlap(
    points: np.ndarray, surfaces: list[np.ndarray], can_touch: np.ndarray, is_floor: np.ndarray, near: NearStencils
) -> Overlap | None:
    """Find two surfaces that can touch and do so, or one of which is inside the other; None if there are none.

    points : (n, 3) [m]; surfaces : triangles (m, 3) of each; can_touch : (p, p) bool, which pairs can touch, on the
    diagonal which can touch themselves; is_floor : (p,) bool, which have an inside although they are open; near : the
    stencils that may touch
    """
    trees = [Tree(points, triangles) for triangles in surfaces]
    for i, j in np.argwhere(np.triu(can_touch)).tolist():
        if i == j:
            if len(crossing_pairs(trees[i])[0]):
                return Overlap(i, i, "itself")
            continue
        if len(crossing_pairs(trees[i], trees[j])[0]):
            return Overlap(i, j, "cross")
        for inner, outer in ((i, j), (j, i)):
            inside = winding_number(points[surfaces[inner][0, 0]], points[surfaces[outer]])
            if inside > (0.0 if is_floor[outer] else 0.5):
                return Overlap(inner, outer, "inside")
    touching = np.flatnonzero(near.clearances(points) <= LEAST_CLEARANCE * near.gap)
    if not len(touching):
        return None
    first, second = sorted(near.pieces[touching[0]].tolist())
    return Overlap(first, second, "touch")


def winding_number(point: np.ndarray, corners: np.ndarray) -> float:
    """Compute how often triangles (m, 3, 3) [m], wound outward, enclose ``point`` (3,) [m]: 1 inside, 0 outside.

    The sum of their solid angles over 4π (van Oosterom and Strackee 1983).
    """
    a, b, c = (corners[:, i] - point for i in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    cosines = la * lb * lc + lc * np.sum(a * b, axis=1) + lb * np.sum(a * c, axis=1) + la * np.sum(b * c, axis=1)
    return float(np.arctan2(triple, cosines).sum() / (2.0 * np.pi))
