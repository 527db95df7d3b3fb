"""Reader of legacy VTK POLYDATA files, which ParaView and Slicer write and meshio does not read."""

from pathlib import Path

import numpy as np

from palpate.bodies.mesh_checks import check_coordinates

_TYPES = {"float": ">f4", "double": ">f8", "int": ">i4", "vtktypeint64": ">i8", "long": ">i8"}


def is_polydata(path: Path) -> bool:
    """Test whether a legacy VTK file holds a surface, not an unstructured grid."""
    with path.open("rb") as file:
        return b"POLYDATA" in file.read(512).upper()


def read_polydata(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read points (n, 3) and triangles (m, 3) of an ASCII or binary file, version 2 to 5.1.

    Raises ValueError if it is malformed, KeyError if it uses a number type that such files never have.
    Coordinates are checked at once: where binary data are damaged, they show it first.
    """
    cursor = _Cursor(path.read_bytes())
    cursor.line(), cursor.line()
    cursor.binary = cursor.line().upper() == "BINARY"
    cursor.line()
    words = cursor.expect("POINTS")
    points = cursor.array(3 * int(words[1]), words[2]).astype(float).reshape(-1, 3)
    check_coordinates(str(path), points)
    words = cursor.expect("POLYGONS")
    count, size = int(words[1]), int(words[2])
    if cursor.peek("OFFSETS"):
        offsets = cursor.array(count, cursor.line().split()[1]).astype(np.int64)
        corners = cursor.array(size, cursor.expect("CONNECTIVITY")[1])
        all_triangles = np.array_equal(offsets, 3 * np.arange(count))
    else:
        table = cursor.array(size, "int")
        all_triangles = size == 4 * count and bool(np.all(table[::4] == 3))
        corners = table.reshape(-1, 4)[:, 1:] if all_triangles else table
    if not all_triangles:
        raise ValueError("its polygons are not all triangles")
    return points, corners.reshape(-1, 3).astype(np.int64)


class _Cursor:
    """Position in the file: header lines and arrays follow each other."""

    def __init__(self, data: bytes):
        self.data, self.position, self.binary = data, 0, False

    def line(self) -> str:
        """Read the next line that is not blank."""
        while self.position < len(self.data):
            end = self.data.find(b"\n", self.position)
            end = len(self.data) if end < 0 else end
            text = self.data[self.position : end].decode("ascii", "replace").strip()
            self.position = end + 1
            if text:
                return text
        raise ValueError("it ends too early")

    def peek(self, keyword: str) -> bool:
        return self.data[self.position : self.position + 64].lstrip().upper().startswith(keyword.encode())

    def expect(self, keyword: str) -> list[str]:
        """Split the next line, which must start with the keyword, into words."""
        words = self.line().split()
        if words[0].upper() == "METADATA":  # of the array before it, up to a blank line
            self.position = self.data.find(b"\n\n", self.position) + 1
            words = self.line().split()
        if words[0].upper() != keyword:
            raise ValueError(f"{keyword} is missing where it is expected")
        return words

    def array(self, count: int, kind: str) -> np.ndarray:
        if self.binary:
            dtype = np.dtype(_TYPES[kind.lower()])
            values = np.frombuffer(self.data, dtype, count, self.position)
            self.position += count * dtype.itemsize
            return values
        words: list[str] = []
        while len(words) < count:
            words += self.line().split()
        return np.array(words, dtype=float)
