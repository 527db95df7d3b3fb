"""Readers of surface files by VTK, after a check that the file is whole.

Measured with 56 small files (docs/add-a-body.md has the table): VTK 9.7 reads all that exporters write, meshio 5.3.5
refuses normal OBJ and half of STL and PLY, and trimesh 5.2 misreads OBJ files whose relative numbers stand between the
points. Trap: VTK accepts some truncated files and crashes on truncated PLY, which are therefore found first.
"""

import re
from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.bodies.surfaces.triangles import arrays

CUT = "it is cut off: {}; download or export it again"
SIGNATURES = {
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"GIF8": "a GIF picture",
    b"%PDF": "a PDF document",
    b"PK\x03\x04": "a ZIP archive",
    b"\x1f\x8b": "a gzip archive",
    b"<!DOCTYPE": "a web page",
    b"<html": "a web page",
}
"""How files begin that are often named as meshes, and what they are."""
FIRST_WORDS = {
    b"solid": ".stl",
    b"ply": ".ply",
    b"OFF": ".off",
    b"$MeshFormat": ".msh",
    b"MeshVersionFormatted": ".mesh",
}
"""First words of mesh files, by which one with another format's name is known."""
NO_NORMAL = 1e6  # a component that no triangle's normal has; of random bytes, 4 in 10 are larger
_PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
# (name, count, [(type of the list's length or None, type of the value)])
_Element = tuple[str, int, list[tuple[str | None, str]]]


def check_content(kind: str, data: bytes) -> None:
    """Raise ValueError if a file's content is of another kind than its suffix, ``kind``, says, or is cut off."""
    for signature, what in SIGNATURES.items():
        if data[: len(signature)].lower() == signature.lower():
            raise ValueError(f"it holds {what} and no mesh; give the file of the mesh, or unpack or export it")
    if data.startswith(b"version https://git-lfs"):
        raise ValueError("it holds a pointer of Git LFS in place of the mesh; get the mesh with git lfs pull")
    if (other := _other_format(kind, data)) is not None:
        raise ValueError(f"it holds what a {other} file holds; give it a name that ends in {other}")
    first = data.lstrip()[:5].lower()
    if kind == ".stl" and first not in (b"", b"solid") and b"\0" not in data and data.isascii():
        raise ValueError("it holds a text that does not begin with solid, and so is no STL file; give that of the mesh")

    checks: dict[str, Callable[[bytes], None]] = {
        ".stl": _check_stl,
        ".ply": _check_ply,
        ".obj": _check_obj,
        ".off": _check_off,
        ".msh": _check_gmsh,
        ".vtu": _check_vtu,
    }
    if not data.strip():
        raise ValueError("it is empty")
    if kind in checks:
        checks[kind](data)


def _other_format(kind: str, data: bytes) -> str | None:
    """Return the suffix of the format that the content has, if it is another than ``kind``."""
    word = data[:100].split(None, 1)[:1]
    found = ".stl" if _is_whole_binary_stl(data) else FIRST_WORDS.get(word[0]) if word else None
    return None if found in (None, kind) or (kind == ".stl" and b"\0" in data[:84]) else found


def _is_whole_binary_stl(data: bytes) -> bool:
    return len(data) >= 84 and len(data) == 84 + 50 * int(np.frombuffer(data, "<u4", 1, 80)[0])


def is_binary_stl(data: bytes) -> bool:
    """Test whether an STL file is binary; trap: the header of a binary one may begin with "solid", too."""
    if _is_whole_binary_stl(data):
        return True
    return data.lstrip()[:5].lower() != b"solid" or b"\0" in data[:1000]


def _check_stl(data: bytes) -> None:
    if not is_binary_stl(data):
        if not data.rstrip().rsplit(b"\n", 1)[-1].strip().lower().startswith(b"endsolid"):
            raise ValueError(CUT.format("its last line is not endsolid"))
        return
    if len(data) < 84:
        raise ValueError(CUT.format(f"its {len(data)} bytes do not hold even the header of a binary STL file"))
    announced, there = int(np.frombuffer(data, "<u4", 1, 80)[0]), (len(data) - 84) // 50
    if announced > there:
        normals = np.frombuffer(data, [("normal", "<f4", 3), ("rest", "V38")], there, 84)["normal"]
        if not (np.abs(normals) < NO_NORMAL).all():
            raise ValueError("it holds neither the text nor the triangles of an STL file; give that of the mesh")
        raise ValueError(CUT.format(f"its header announces {announced} triangles and {there} are there"))


def _check_obj(data: bytes) -> None:
    last = data.replace(b"\\\n", b" ").rsplit(b"\n", 1)[-1].split()
    if last and last[0] in (b"v", b"f") and len(last) < 4:
        raise ValueError(CUT.format(f"its last line is {b' '.join(last).decode('latin-1')!r}"))
    if re.search(rb"^\s*v\s", data, re.M) and not re.search(rb"^\s*f\s", data, re.M):
        raise ValueError(CUT.format("it has points and no faces"))


def _check_off(data: bytes) -> None:
    lines = [words for line in data.split(b"\n") if (words := line.split(b"#")[0].split())]
    lines = lines[1:] if not lines[0][0].isdigit() else lines
    points, faces = int(lines[0][0]), int(lines[0][1])
    if len(lines) < 1 + points + faces:
        raise ValueError(
            CUT.format(f"it announces {points} points and {faces} faces and has {len(lines) - 1} lines of them")
        )


def _check_gmsh(data: bytes) -> None:
    if data.startswith(b"$") and b"$End" not in data.rstrip()[-40:] and b"$END" not in data.rstrip()[-40:]:
        raise ValueError(CUT.format("its last section has no end"))


def _check_vtu(data: bytes) -> None:
    if b"<VTKFile" in data[:1000] and b"</VTKFile>" not in data[-200:]:
        raise ValueError(CUT.format("its last line is not </VTKFile>"))


def _check_ply(data: bytes) -> None:
    head, found, body = data.partition(b"end_header")
    if not head.startswith(b"ply"):
        raise ValueError("it does not start like a PLY file")
    if not found:
        raise ValueError(CUT.format("its header has no end"))
    body = body[2:] if body.startswith(b"\r\n") else body[1:]
    elements = _ply_elements(head)
    announced = " and ".join(f"{count} of {name}" for name, count, _ in elements)
    if b"format ascii" in head:
        lines = [line for line in body.split(b"\n") if line.strip()]
        whole = len(lines) >= sum(count for _, count, _ in elements)
        if whole and elements and elements[-1][2] and elements[-1][2][0][0] and lines:
            last = lines[sum(count for _, count, _ in elements) - 1].split()
            whole = len(last) > int(last[0])
    else:
        whole = _ply_length(elements, body, ">" if b"binary_big_endian" in head else "<") <= len(body)
    if not whole:
        raise ValueError(CUT.format(f"its header announces {announced}, and fewer are there"))


def _ply_elements(head: bytes) -> list[_Element]:
    elements: list[_Element] = []
    for words in (line.split() for line in head.decode("latin-1").splitlines()):
        if words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:2] == ["property", "list"]:
            elements[-1][2].append((_PLY_TYPES[words[2]], _PLY_TYPES[words[3]]))
        elif words[:1] == ["property"]:
            elements[-1][2].append((None, _PLY_TYPES[words[1]]))
    return elements


def _ply_length(elements: list[_Element], body: bytes, order: str) -> int:
    """Compute the bytes that the elements take, walking along their lists, as far as the content reaches."""
    position = 0
    for _, count, properties in elements:
        if all(length is None for length, _ in properties):
            position += count * sum(np.dtype(value).itemsize for _, value in properties)
            continue
        for _ in range(count):
            for length, value in properties:
                entries = 1
                if length is not None:
                    size = np.dtype(length).itemsize
                    if position + size > len(body):
                        return len(body) + 1
                    entries = int(np.frombuffer(body, order + length, 1, position)[0])
                    position += size
                position += entries * np.dtype(value).itemsize
    return position


SURFACES = (".stl", ".obj", ".ply", ".off")


def read_surface(kind: str, data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read points (n, 3) and triangles (m, 3) from a file's content; polygons are cut into triangles.

    kind : ``.stl``, ``.obj``, ``.ply``, ``.off`` or ``.vtk`` (legacy polydata)
    Raises ValueError if it is malformed; the content must have passed ``check_content``.
    Trap: VTK stores coordinates of all but ``.vtk`` in single precision.
    """
    from vtkmodules.vtkCommonCore import vtkObject
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    shown = vtkObject.GetGlobalWarningDisplay()
    vtkObject.GlobalWarningDisplayOff()
    try:
        reader = _reader(kind, data)
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


def _reader(kind: str, data: bytes) -> Any:
    """Return VTK's reader of a file's content."""
    from vtkmodules import vtkIOGeometry, vtkIOLegacy, vtkIOPLY
    from vtkmodules.vtkIOCore import vtkMemoryResourceStream

    readers: dict[str, Callable[[], Any]] = {
        ".stl": vtkIOGeometry.vtkSTLReader,
        ".obj": vtkIOGeometry.vtkOBJReader,
        ".off": vtkIOGeometry.vtkOFFReader,
        ".ply": vtkIOPLY.vtkPLYReader,
        ".vtk": vtkIOLegacy.vtkPolyDataReader,
    }
    reader = readers[kind]()
    if kind == ".stl":
        # the points are merged with a tolerance later
        reader.MergingOff()
        data = _plain_stl(data)
    elif kind == ".obj":
        # VTK joins continued lines of faces, but not of points
        data = data.replace(b"\r\n", b"\n").replace(b"\\\n", b" ")
    stream = vtkMemoryResourceStream()
    stream.SetBuffer(data, len(data), True)
    reader.SetStream(stream)
    if kind in (".ply", ".vtk"):
        reader.ReadFromInputStreamOn()
    return reader


def _plain_stl(data: bytes) -> bytes:
    """Return an STL file's content as VTK reads it."""
    if not is_binary_stl(data):
        return data.lower()
    # some programs append data of their own, announce no triangles, or begin the header as an ASCII file does
    count = int(np.frombuffer(data, "<u4", 1, 80)[0]) or (len(data) - 84) // 50
    return b"binary".ljust(80) + count.to_bytes(4, "little") + data[84 : 84 + 50 * count]
