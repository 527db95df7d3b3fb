"""Merging of points that coincide, and dropping of those that no element uses."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

# points closer than this fraction of the size are merged: an STL file repeats each corner, in single precision
WELD = 1e-6


def weld(points: np.ndarray, triangles: np.ndarray, fraction: float = WELD) -> tuple[np.ndarray, np.ndarray]:
    """Merge points closer than a fraction of the size; drop the triangles that this degenerates, and unused points."""
    tolerance = fraction * np.ptp(points, axis=0).max()
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points), len(points)))
    group = connected_components(graph, directed=False)[1]
    first = np.unique(group, return_index=True)[1]
    triangles = first[group][triangles]
    a, b, c = triangles.T
    return drop_unused(points, triangles[(a != b) & (b != c) & (c != a)])


def drop_unused(points: np.ndarray, elements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Drop the points that no element uses, and number the others anew in their order."""
    used = np.unique(elements)
    return np.ascontiguousarray(points[used]), np.searchsorted(used, elements)
