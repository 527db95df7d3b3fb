"""Places spread over a triangulated surface, and the distance between two surfaces."""

import numpy as np

from palpate.bodies.surfaces.decimate import area_normals
from palpate.bodies.surfaces.polydata import polydata


def sample(points: np.ndarray, triangles: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Spread places over a surface, at most about ``spacing`` apart: (k, 3), and their unit normals, (k, 3)."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    normals = area_normals(points, triangles)
    lengths = np.linalg.norm(normals, axis=1)
    longest = np.max([np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    parts = np.ceil(longest / spacing).astype(int)
    places, facing = [], []
    for count in np.unique(parts[lengths > 0]):
        chosen = np.flatnonzero((parts == count) & (lengths > 0))
        u, v = (x.ravel() for x in np.meshgrid(np.arange(count), np.arange(count)))
        # centres of the triangles that each is split into
        first, second = u + v < count, u + v < count - 1
        along = np.concatenate([u[first] + 1 / 3, u[second] + 2 / 3])[:, None] / count
        across = np.concatenate([v[first] + 1 / 3, v[second] + 2 / 3])[:, None] / count
        sides = (b - a)[chosen, None], (c - a)[chosen, None]
        places.append((a[chosen, None] + along * sides[0] + across * sides[1]).reshape(-1, 3))
        facing.append(np.repeat(normals[chosen] / lengths[chosen, None], len(along), axis=0))
    return np.vstack(places), np.vstack(facing)


def distances(places: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Compute the distance of places, (k, 3), from a surface, (k,)."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersGeneral import vtkDistancePolyDataFilter

    measure = vtkDistancePolyDataFilter()
    # VTK wants a cell; the distances are those of the points
    measure.SetInputData(0, polydata(places, np.zeros((1, 3), dtype=np.int64)))
    measure.SetInputData(1, polydata(points, triangles))
    measure.SignedDistanceOff()
    measure.ComputeSecondDistanceOff()
    measure.ComputeCellCenterDistanceOff()
    measure.Update()
    return np.abs(vtk_to_numpy(measure.GetOutput().GetPointData().GetArray("Distance")))
