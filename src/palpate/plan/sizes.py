"""Find how large a body's meshes are, or estimate it before they are made."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.errors import InputError

HELD = 0.08
"""Share of the coarse surface nodes that anchors usually hold."""
SURFACE = (140, 528, 33)
"""A filled surface of the tests: its nodes, tetrahedra and inner nodes, from which those of others are estimated."""


KEPT, REMESHED = 400, 200
"""Nodes up to which the surface in a file is filled as it is, and about how many a larger one is remeshed to."""


@dataclass(frozen=True)
class Level:
    """The size of one mesh: its nodes, those on the surface, and its tetrahedra, or the triangles of a sheet."""

    nodes: int
    surface: int
    elements: int

    def refined(self) -> "Level":
        """Return the size after each tetrahedron is split into eight, by Euler's formula for a body without holes."""
        edges = self.nodes + self.elements + self.surface - 3
        return Level(self.nodes + edges, 4 * self.surface - 6, 8 * self.elements)


@dataclass(frozen=True)
class Size:
    """The sizes of a body's levels, coarse first, how many nodes can be pressed, and if a file has to be remeshed."""

    levels: tuple[Level, ...]
    contacts: int
    remeshed: bool = False

    @property
    def coarse(self) -> Level:
        return self.levels[0]

    @property
    def fine(self) -> Level:
        return self.levels[-1]


def size_of(entry: dict, folder: Path, made: Path | None = None) -> Size:
    """Return the size of the body of a config entry whose paths are relative to ``folder``.

    made : the body's own file, if it is up to date; without it sizes of meshes that are read or filled are estimates
    """
    if made is not None and made.is_file():
        coarse, remeshed = _made(made), False
    elif entry["kind"] == "file":
        coarse, remeshed = _file(entry, folder)
    else:
        coarse, remeshed = _coarse(entry), False
    levels = [coarse]
    for _ in range(entry.get("refinements", 0)):
        levels.append(levels[-1].refined())
    return Size(tuple(levels), round((1.0 - HELD) * coarse.surface), remeshed)


def filled(surface: int) -> Level:
    """Estimate the size of a closed surface of so many nodes once it is filled with tetrahedra as long as its edges."""
    nodes, tetrahedra, inner = SURFACE
    ratio = surface / nodes
    return Level(surface + round(inner * ratio**1.77), surface, round(tetrahedra * ratio**1.46))


def _coarse(entry: dict) -> Level:
    kinds: dict[str, Callable[[], Level]] = {
        "cylinder": lambda: Level(266, 182, 936),
        "liver": lambda: Level(190, 140, 628),
        "kidney": lambda: Level(166, 140, 479),
        "stomach": lambda: Level(165, 140, 471),
        "box": lambda: _box(entry["divisions"]),
        "sheet": lambda: _sheet(entry["divisions"]),
        "ct": lambda: filled(entry["surface_nodes"]),
    }
    return kinds[entry["kind"]]()


def _box(divisions: list[int]) -> Level:
    x, y, z = divisions
    nodes, inner = (x + 1) * (y + 1) * (z + 1), (x - 1) * (y - 1) * (z - 1)
    return Level(nodes, nodes - inner, 6 * x * y * z)


def _sheet(divisions: list[int]) -> Level:
    x, y = divisions
    return Level((x + 1) * (y + 1), (x + 1) * (y + 1), 2 * x * y)


def _file(entry: dict, folder: Path) -> tuple[Level, bool]:
    """Return the size of the coarse mesh of a file, and whether it has to be remeshed to that.

    A file that cannot be read is refused when its body is made, and is small here.
    """
    from palpate.bodies.mesh_readers import read

    try:
        raw = read(folder / entry["path"])
    except InputError:
        return filled(SURFACE[0]), False
    wanted = entry.get("surface_nodes")
    if "tetra" in raw.solids:
        tetrahedra = raw.solids["tetra"]
        given = Level(len(raw.points), _surface_of(tetrahedra), len(tetrahedra))
        most = wanted or given.surface
    else:
        triangles = len(raw.sheets.get("triangle", ())) + 2 * len(raw.sheets.get("quad", ()))
        given, most = filled(triangles // 2 + 2), wanted or KEPT
    return (given, False) if given.surface <= most else (filled(wanted or REMESHED), True)


def _surface_of(tetrahedra: np.ndarray) -> int:
    """Return the number of surface nodes of tetrahedra (m, 4)."""
    nodes = np.zeros((int(tetrahedra.max()) + 1, 3))
    return len(TetMesh(nodes, tetrahedra).surface)


def _made(path: Path) -> Level:
    """Read the size of the coarse level of a body's file."""
    import h5py

    with h5py.File(path) as file:
        level = file["level_0"]
        nodes = len(level["nodes"])
        if "triangles" in level:
            return Level(nodes, nodes, len(level["triangles"]))
        return Level(nodes, _surface_of(level["tetrahedra"][()]), len(level["tetrahedra"]))
