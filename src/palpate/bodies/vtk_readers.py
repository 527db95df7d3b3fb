"""Readers of surface files, by VTK.

Measured with 56 small files, of the readers that could be had (docs/add-a-body.md has the table): VTK 9.7 reads all
that exporters write, meshio 5.3.5 refuses normal OBJ and half of STL and PLY, and trimesh 5.2 misreads OBJ files
whose relative numbers stand between the points. VTK crashes on truncated PLY files, which are therefore found first.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.bodies.surfaces.polydata import arrays
from palpate.bodies.whole_files import is_binary_stl

SURFACES = (".stl", ".obj", ".ply", ".off")


def is_polydata(data: bytes) -> bool:
    """Test whether a legacy VTK file holds a surface, not an unstructured grid."""
    return b"DATASET POLYDATA" in data[:1024].upper()


def read_surface(kind: str, data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read points (n, 3) and triangles (m, 3) from a file's content; polygons are cut into triangles.

    kind : ``.stl``, ``.obj``, ``.ply``, ``.off`` or ``.vtk`` (legacy polydata)
    Raises ValueError if it is malformed; the content must have passed ``whole_files.check_whole``.
    Trap: VTK stores coordinates of all but ``.vtk`` in single precision.
    """
    from vtkmodules.vtkCommonCore import vtkObject
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    readers: dict[str, Callable[[bytes], Any]] = {
        ".stl": _stl,
        ".obj": _obj,
        ".ply": _ply,
        ".off": _off,
        ".vtk": _polydata,
    }
    shown = vtkObject.GetGlobalWarningDisplay()
    vtkObject.GlobalWarningDisplayOff()
    try:
        reader = readers[kind](data)
        errors: list[str] = []
        reader.AddObserver("ErrorEvent", lambda *_: errors.append("VTK cannot read it"))
        cut = vtkTriangleFilter()
        cut.PassVertsOff()
        cut.PassLinesOff()
        cut.SetInputConnection(reader.GetOutputPort())
        cut.Update()
    finally:
        vtkObject.SetGlobalWarningDisplay(shown)
    if errors or reader.GetErrorCode():
        raise ValueError("VTK cannot read it")
    points, triangles = arrays(cut.GetOutput())
    if not len(points):
        raise ValueError("it has no points")
    return points, triangles


def _stl(data: bytes) -> Any:
    from vtkmodules.vtkIOGeometry import vtkSTLReader

    reader = vtkSTLReader()
    # the points are merged with a tolerance later
    reader.MergingOff()
    if is_binary_stl(data):
        # some programs append data of their own, announce no triangles, or begin the header as an ASCII file does
        count = int(np.frombuffer(data, "<u4", 1, 80)[0]) or (len(data) - 84) // 50
        data = b"binary".ljust(80) + count.to_bytes(4, "little") + data[84 : 84 + 50 * count]
    else:
        data = data.lower()
    return _with_stream(reader, data)


def _obj(data: bytes) -> Any:
    from vtkmodules.vtkIOGeometry import vtkOBJReader

    # VTK joins continued lines of faces, but not of points
    return _with_stream(vtkOBJReader(), data.replace(b"\r\n", b"\n").replace(b"\\\n", b" "))


def _ply(data: bytes) -> Any:
    from vtkmodules.vtkIOPLY import vtkPLYReader

    return _with_stream(vtkPLYReader(), data, "ReadFromInputStreamOn")


def _off(data: bytes) -> Any:
    from vtkmodules.vtkIOGeometry import vtkOFFReader

    return _with_stream(vtkOFFReader(), data)


def _polydata(data: bytes) -> Any:
    from vtkmodules.vtkIOLegacy import vtkPolyDataReader

    return _with_stream(vtkPolyDataReader(), data, "ReadFromInputStreamOn")


def _with_stream(reader: Any, data: bytes, *switches: str) -> Any:
    from vtkmodules.vtkIOCore import vtkMemoryResourceStream

    stream = vtkMemoryResourceStream()
    stream.SetBuffer(data, len(data), True)
    reader.SetStream(stream)
    for switch in switches:
        getattr(reader, switch)()
    return reader
