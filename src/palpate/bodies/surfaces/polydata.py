"""Triangulated surfaces as VTK's data, and back."""

from typing import Any

import numpy as np


def polydata(points: np.ndarray, triangles: np.ndarray) -> Any:
    """Copy points (n, 3) and triangles (m, 3) into a vtkPolyData, in double precision."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    surface, cells, places = vtkPolyData(), vtkCellArray(), vtkPoints()
    places.SetDataTypeToDouble()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(points, dtype=float), deep=True))
    offsets = np.arange(0, 3 * len(triangles) + 1, 3)
    corners = np.ascontiguousarray(triangles, dtype=np.int64).ravel()
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(corners, deep=True))
    surface.SetPoints(places)
    surface.SetPolys(cells)
    return surface


def arrays(surface: Any) -> tuple[np.ndarray, np.ndarray]:
    """Copy points (n, 3) and triangles (m, 3) out of a vtkPolyData without other polygons."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    if not surface.GetNumberOfPoints():
        return np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
    points = vtk_to_numpy(surface.GetPoints().GetData()).astype(float)
    if not surface.GetNumberOfPolys():
        return points, np.empty((0, 3), dtype=np.int64)
    return points, vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3).astype(np.int64)
