"""Surface of equal grey values in a volume, and its normals from the grey values' gradient."""

import numpy as np


def isosurface(
    samples: np.ndarray, level: float, origin: np.ndarray, spacing: np.ndarray, normals: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Extract the surface where ``samples``, (nz, ny, nx), have a level: points (n, 3), triangles, normals (n, 3).

    origin, spacing : (3,) [m], x y z of the first sample and between samples
    normals : whether to compute unit normals, towards lower values; else they are empty
    Flying edges (Schroeder, Maynard, Geveci 2015), which finds marching cubes' triangles: crossings by linear
    interpolation along voxels' edges, normals by central differences that are interpolated likewise. Empty if nothing
    is above the level.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    grid, edges = vtkImageData(), vtkFlyingEdges3D()
    grid.SetDimensions(samples.shape[::-1])
    grid.SetSpacing(*spacing.tolist())
    grid.SetOrigin(*origin.tolist())
    grid.GetPointData().SetScalars(numpy_to_vtk(samples.ravel(), deep=True))
    edges.SetInputData(grid)
    edges.SetValue(0, level)
    edges.SetComputeNormals(normals)
    edges.Update()
    found = edges.GetOutput()
    if not found.GetNumberOfPolys():
        return np.empty((0, 3)), np.empty((0, 3), dtype=np.int64), np.empty((0, 3))
    triangles = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3).astype(np.int64)
    points = vtk_to_numpy(found.GetPoints().GetData()).astype(float)
    slopes = vtk_to_numpy(found.GetPointData().GetNormals()).astype(float) if normals else np.empty((0, 3))
    return points, triangles, slopes
