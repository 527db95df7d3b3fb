"""Lattice of equal cells, cut into triangles or tetrahedra without a preferred direction."""

from itertools import permutations

import numpy as np


def cut_lattice(divisions: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Cut a lattice into simplices (m, d + 1) of its points (n, d), the last axis fastest, d = len(divisions).

    Every cell is cut into the d! simplices around one diagonal (Kuhn), and is the mirror image of each of its
    neighbours (Todd's J1, in the plane the "union jack"): diagonals run from points with only even coordinates
    to points with only odd ones, so that they agree on shared faces. Trap: with one diagonal direction for all
    cells, a body twists when it is bent; mirrored cells lean to both sides equally, and the mesh is its own
    mirror image along each axis that has an even number of cells. Orientation of the simplices is mixed.
    """
    d, counts = len(divisions), np.array(divisions)
    points = np.stack(np.meshgrid(*(np.arange(c + 1) for c in divisions), indexing="ij"), axis=-1).reshape(-1, d)
    cells = points[(points < counts).all(axis=1)]
    even, step = cells + cells % 2, 1 - 2 * (cells % 2)
    axes = np.eye(d, dtype=np.int64)
    paths = np.array([np.cumsum([0 * axes[0], *axes[list(order)]], axis=0) for order in permutations(range(d))])
    corners = even[:, None, None] + step[:, None, None] * paths
    strides = np.append(np.cumprod((counts + 1)[:0:-1])[::-1], 1)
    return points, (corners @ strides).reshape(-1, d + 1)
