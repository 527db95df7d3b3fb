"""Triangles from legacy VTK POLYDATA files, which ParaView and Slicer write and meshio does not read."""

from pathlib import Path

import numpy as np

from palpate.bodies.mesh_checks import check_coordinates

_TYPES = {"float": ">f4", "double": ">f8", "int": ">i4", "vtktypeint64": ">i8", "long": ">i8"}


def is_polydata(path: Path) -> bool:
    """Whether a legacy VTK file holds a surface and not an unstructured grid."""
    with path.open("rb") as file:
        return b"POLYDATA" in file.read(512).upper()


def read_polydata(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and triangles (m, 3) of an ASCII or binary file, version 2 to 5.1.

    ValueError if it is malformed, KeyError if it uses a number type that such files never do.
    Coordinates are checked at once: where binary data were damaged, they show it first.
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
        three = np.array_equal(offsets, 3 * np.arange(count))
    else:
        table = cursor.array(size, "int")
        three = size == 4 * count and bool(np.all(table[::4] == 3))
        corners = table.reshape(-1, 4)[:, 1:] if three else table
    if not three:
        raise ValueError("its polygons are not all triangles")
    return points, corners.reshape(-1, 3).astype(np.int64)


class _Cursor:
    """A place in the file: header lines and arrays follow each other."""

    def __init__(self, data: bytes):
        self.data, self.at, self.binary = data, 0, False

    def line(self) -> str:
        """The next line that is not blank."""
        while self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            text = self.data[self.at : end].decode("ascii", "replace").strip()
            self.at = end + 1
            if text:
                return text
        raise ValueError("it ends too early")

    def peek(self, keyword: str) -> bool:
        return self.data[self.at : self.at + 64].lstrip().upper().startswith(keyword.encode())

    def expect(self, keyword: str) -> list[str]:
        """The words of the next line, which must start with the keyword."""
        words = self.line().split()
        if words[0].upper() == "METADATA":  # notes on the array before it, up to a blank line
            self.at = self.data.find(b"\n\n", self.at) + 1
            words = self.line().split()
        if words[0].upper() != keyword:
            raise ValueError(f"{keyword} does not follow where it should")
        return words

    def array(self, count: int, kind: str) -> np.ndarray:
        if self.binary:
            dtype = np.dtype(_TYPES[kind.lower()])
            values = np.frombuffer(self.data, dtype, count, self.at)
            self.at += count * dtype.itemsize
            return values
        values = []
        while len(values) < count:
            values += self.line().split()
        return np.array(values, dtype=float)
