"""Holes of a triangulated surface: found, measured and closed."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from palpate.bodies.surfaces.polydata import arrays, polydata

# a hole whose corners are this close to a plane, relative to its width, is flat
FLAT = 0.03


@dataclass(frozen=True)
class Hole:
    """Open edges that hang together: their number, the width of the hole [m], its centre (3,) [m], if it is flat."""

    edges: int
    width_m: float
    centre_m: np.ndarray
    flat: bool


def find_holes(points: np.ndarray, triangles: np.ndarray) -> list[Hole]:
    """Find the holes of a surface, (n, 3) [m] and (m, 3)."""
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, count = np.unique(ends, axis=0, return_counts=True)
    opened = edges[count == 1]
    if not len(opened):
        return []
    graph = sparse.coo_array((np.ones(len(opened)), opened.T), shape=(len(points), len(points)))
    label = connected_components(graph, directed=False)[1][opened[:, 0]]
    holes = []
    for number in np.unique(label):
        loop = opened[label == number]
        corners = points[np.unique(loop)]
        width = float(np.ptp(corners, axis=0).max())
        centre = corners.mean(axis=0)
        thickness = np.linalg.svd(corners - centre, compute_uv=False)[-1] / np.sqrt(len(corners))
        holes.append(Hole(len(loop), width, centre, bool(thickness <= FLAT * width)))
    return holes


def close_holes(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Close every hole with triangles between its corners, by VTK."""
    from vtkmodules.vtkFiltersModeling import vtkFillHolesFilter

    fill = vtkFillHolesFilter()
    fill.SetInputData(polydata(points, triangles))
    fill.SetHoleSize(float(np.linalg.norm(np.ptp(points, axis=0))))
    fill.Update()
    return arrays(fill.GetOutput())
