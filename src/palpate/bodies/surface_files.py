"""Reading of surface files (STL, OBJ, PLY, OFF) in double precision, after a check that they are what their names say.

VTK 9.7 keeps coordinates of these formats in single precision, which far from the origin moves points by millimetres;
meshio 5.3.5 refuses normal OBJ and half of STL and PLY, and trimesh 5.2 misreads relative numbers in OBJ.
"""

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from typing import Any

import numpy as np

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

Polygons = tuple[np.ndarray, list | np.ndarray]
"""Points (n, 3), and the corners of each polygon."""


@contextmanager
def vtk_errors() -> Iterator[None]:
    """Raise ValueError with the first error that VTK reports inside the block, in place of printing it."""
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    level = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        with pyvista.VtkErrorCatcher(send_to_logging=False) as caught:
            yield
    finally:
        vtkLogger.SetStderrVerbosity(level)
    if caught.error_events:
        reason = caught.error_events[0].alert.partition(" for file")[0].strip(" .:")
        raise ValueError(reason if reason.isascii() and reason.isprintable() else "VTK cannot read it")


def check_content(kind: str, data: bytes) -> None:
    """Raise ValueError if a file's content is of another kind than its suffix, ``kind``, says, or is empty."""
    for signature, kind_found in SIGNATURES.items():
        if data[: len(signature)].lower() == signature.lower():
            raise ValueError(f"it holds {kind_found} and no mesh; give the file of the mesh, or unpack or export it")
    if data.startswith(b"version https://git-lfs"):
        raise ValueError("it holds a pointer of Git LFS in place of the mesh; get the mesh with git lfs pull")
    if not data.strip():
        raise ValueError("it is empty")
    content = ".stl" if _is_whole_binary_stl(data) else FIRST_WORDS.get(data.lstrip()[:100].split(None, 1)[0], kind)
    if content != kind and not (kind == ".stl" and b"\0" in data[:84]):
        raise ValueError(f"it holds what a {content} file holds; give it a name that ends in {content}")


def read_surface(kind: str, data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read points (n, 3) and triangles (m, 3) from a file's content; polygons are cut into triangles.

    kind : one of SURFACES; raises ValueError if the content is malformed or cut off
    """
    points, faces = SURFACES[kind](data)
    if points.shape[1:] != (3,) or not len(points):
        raise ValueError("it has no points of three coordinates")
    counts = np.fromiter(map(len, faces), dtype=np.int64)
    corners = np.fromiter(chain.from_iterable(faces), dtype=np.int64)
    if len(corners) and not (corners.min() >= 0 and corners.max() < len(points)):
        raise ValueError(f"its faces refer to points that are not among its {len(points)}")
    if (counts == 3).all():
        return points, corners.reshape(-1, 3)
    import pyvista

    with vtk_errors():
        triangulated = pyvista.PolyData(points, np.insert(corners, np.cumsum(counts) - counts, counts)).triangulate()
    return points, triangulated.regular_faces.astype(np.int64)


_STL = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_FACET = re.compile(rb"outer\s+loop" + 3 * rb"\s+vertex\s+(\S+)\s+(\S+)\s+(\S+)" + rb"\s+endloop")


def _read_stl(data: bytes) -> Polygons:
    """Read an STL file, text or binary: the corners (3 m, 3) of m triangles, and their numbers for each triangle."""
    text = data.lower()
    # trap: the header of a binary one may begin with "solid", too
    begins_with_solid = text.lstrip().startswith(b"solid")
    if _is_whole_binary_stl(data) or b"\0" in data[:1000] or not (begins_with_solid or data.isascii()):
        corners = _binary_stl(data)
    elif not begins_with_solid:
        raise ValueError("it holds a text that does not begin with solid, and so is no STL file; give that of the mesh")
    elif not text.rstrip().splitlines()[-1].strip().startswith(b"endsolid"):
        raise ValueError(CUT.format("its last line is not endsolid"))
    else:
        facets = _FACET.findall(text)
        if len(facets) != (loops := text.count(b"endloop")):
            raise ValueError(f"{loops - len(facets)} of its {loops} facets have not three vertices")
        corners = np.array(facets, dtype=bytes).astype(float).reshape(-1, 3)
    return corners, np.arange(len(corners)).reshape(-1, 3)


def _is_whole_binary_stl(data: bytes) -> bool:
    """Test whether data are binary STL of the announced length, or several of them joined."""
    if len(data) < 84:
        return False
    bytes_after = len(data) - 84 - 50 * int(np.frombuffer(data, "<u4", 1, 80)[0])
    return bytes_after == 0 or (84 < bytes_after < len(data) - 84 and _is_whole_binary_stl(data[-bytes_after:]))


def _binary_stl(data: bytes) -> np.ndarray:
    """Read the corners (3 m, 3) of the m triangles of a binary STL file, or of several that are joined."""
    if len(data) < 84:
        raise ValueError(CUT.format(f"its {len(data)} bytes do not hold even the header of a binary STL file"))
    announced, present = int(np.frombuffer(data, "<u4", 1, 80)[0]), (len(data) - 84) // 50
    # some programs announce no triangles, or append data of their own
    triangles = np.frombuffer(data, _STL, min(announced or present, present), 84)
    if announced > present:
        if not (np.abs(triangles["normal"]) < NO_NORMAL).all():
            raise ValueError("it holds neither the text nor the triangles of an STL file; give that of the mesh")
        raise ValueError(CUT.format(f"its header announces {announced} triangles and {present} are there"))
    corners = triangles["corners"].reshape(-1, 3).astype(float)
    after = data[84 + 50 * len(triangles) :]
    if _is_whole_binary_stl(after):
        return np.vstack([corners, _binary_stl(after)])
    if len(after) > 84:
        warnings.warn(
            f"{len(after)} bytes after the {len(triangles)} triangles of an STL file are left out.", stacklevel=2
        )
    return corners


def _read_obj(data: bytes) -> Polygons:
    """Read points and polygons of an OBJ file, whose faces count points from 1, or backwards if they are negative."""
    points: list[list[bytes]] = []
    faces: list[list[int]] = []
    words: list[bytes] = []
    for line in re.sub(rb"\\\r?\n", b" ", data).splitlines():
        words = line.partition(b"#")[0].split()
        if words[:1] == [b"v"]:
            points.append(words[1:4])
        elif words[:1] == [b"f"]:
            numbers = [int(word.partition(b"/")[0]) for word in words[1:]]
            faces.append([number - 1 if number > 0 else number + len(points) for number in numbers])
    if words[:1] in ([b"v"], [b"f"]) and len(words) < 4:
        raise ValueError(CUT.format(f"its last line is {b' '.join(words).decode('latin-1')!r}"))
    if points and not faces:
        raise ValueError(CUT.format("it has points and no faces"))
    return np.array(points, dtype=bytes).astype(float), faces


def _read_off(data: bytes) -> Polygons:
    """Read OFF, COFF, NOFF and STOFF; their first word may be missing, or stand on the line of the counts."""
    text = re.sub(rb"#[^\r\n]*", b"", data).lstrip()
    word = re.match(rb"(ST)?C?N?OFF(?!\s+BINARY)", text)
    (counts, *rows) = [row for line in text[word.end() if word else 0 :].splitlines() if (row := line.split())]
    points, faces = int(counts[0]), int(counts[1])
    polygons = rows[points : points + faces]
    if len(polygons) < faces or any(len(row) <= int(row[0]) for row in polygons):
        raise ValueError(
            CUT.format(f"it announces {points} points and {faces} faces and has {len(rows)} lines of them")
        )
    corners = [[int(corner) for corner in row[1 : 1 + int(row[0])]] for row in polygons]
    return np.array([row[:3] for row in rows[:points]], dtype=bytes).astype(float), corners


_PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
_PLY_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def _read_ply(data: bytes) -> Polygons:
    """Read the vertices and faces of a PLY file, text or binary, in the order and types that its header announces."""
    head, marker, body = data.partition(b"end_header")
    if not head.startswith(b"ply"):
        raise ValueError("it does not start like a PLY file")
    if not marker:
        raise ValueError(CUT.format("its header has no end"))
    body = body[2:] if body.startswith(b"\r\n") else body[1:]
    # (name, count, [(name, type of the list's length or None, type of the value)])
    elements: list[tuple[str, int, list[tuple[str, str | None, str]]]] = []
    order = ""
    for words in (line.split() for line in head.decode("latin-1").splitlines()):
        if words[:1] == ["format"]:
            order = _PLY_ORDERS[words[1]]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            types = [order + _PLY_TYPES[word] if order else "f8" for word in words[1:-1] if word != "list"]
            elements[-1][2].append((words[-1], types[0] if words[1] == "list" else None, types[-1]))
    if not order:  # a text is read like the others, as if all of its numbers were doubles
        body = np.array(body.split(), dtype=bytes).astype(float).tobytes()
    position, points, faces = 0, np.empty((0, 3)), []

    def take(kind: Any, count: int) -> np.ndarray:
        nonlocal position
        values = np.frombuffer(body, kind, count, position)
        position += values.nbytes
        return values

    try:
        for name, count, properties in elements:
            if all(length is None for _, length, _ in properties):
                table = take([(key, value) for key, _, value in properties], count)
                if name == "vertex":
                    points = np.column_stack([table[axis] for axis in "xyz"]).astype(float)
                continue
            for _ in range(count):
                for key, length, value in properties:
                    values = take(value, 1 if length is None else int(take(length, 1)[0]))
                    if name == "face" and key in ("vertex_index", "vertex_indices"):
                        faces.append(values)
    except ValueError as error:
        announced = " and ".join(f"{count} of {name}" for name, count, _ in elements)
        raise ValueError(CUT.format(f"its header announces {announced}, and fewer are there")) from error
    return points, faces


SURFACES = {".stl": _read_stl, ".obj": _read_obj, ".ply": _read_ply, ".off": _read_off}
