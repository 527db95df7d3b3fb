"""Whether a scene begins with everything apart: what overlaps at first could never be told which way to go."""

import numpy as np

from palpate.collision.contact.proximity import Near
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import crossing_pairs
from palpate.errors import InputError

TOUCH = 1e-8
"""Room, in gaps, that is as good as none: the barrier would begin with forces beyond any sense."""


def check_apart(points, surfaces, names, able, grounds, near: Near) -> None:
    """Raise InputError, naming them, if two surfaces that can meet touch, or if one is inside another.

    points : (n, 3) [m]; surfaces : triangles (m, 3) of each; able : (p, p) bool, which can meet, on the diagonal which
    can meet themselves; grounds : (p,) bool, which have an inside though they are open; near : what may touch
    """
    trees = [Tree(points, triangles) for triangles in surfaces]
    for i, j in np.argwhere(np.triu(able)):
        if i == j:
            if len(crossing_pairs(trees[i])[0]):
                raise InputError(f"{names[i]} goes through itself where the scene begins; choose another start.")
            continue
        if len(crossing_pairs(trees[i], trees[j])[0]):
            raise InputError(f"{names[i]} goes through {names[j]} where the scene begins; move them apart.")
        for inner, outer in ((i, j), (j, i)):
            inside = winding(points[surfaces[inner][0, 0]], points[surfaces[outer]])
            if inside > (0.0 if grounds[outer] else 0.5):
                raise InputError(f"{names[inner]} is inside {names[outer]} where the scene begins; move it out.")
    touching = np.flatnonzero(near.rooms(points) <= TOUCH * near.gap)
    if len(touching):
        first, second = (names[i] for i in sorted(near.pieces[touching[0]]))
        raise InputError(f"{first} and {second} touch where the scene begins; move them apart.")


def winding(point: np.ndarray, corners: np.ndarray) -> float:
    """How often triangles (m, 3, 3) [m], wound outward, go around ``point`` (3,) [m]: 1 inside a closed surface, 0
    outside; the sum of their solid angles over 4π (van Oosterom and Strackee 1983)."""
    a, b, c = (corners[:, i] - point for i in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    cosines = la * lb * lc + lc * np.sum(a * b, axis=1) + lb * np.sum(a * c, axis=1) + la * np.sum(b * c, axis=1)
    return float(np.arctan2(triple, cosines).sum() / (2.0 * np.pi))
