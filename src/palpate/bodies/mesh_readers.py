"""Readers of every mesh format that is accepted, into points and named blocks of elements."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.bodies.mesh_checks import check_coordinates
from palpate.bodies.mesh_tags import Tags, cell_tags, gmsh_tags
from palpate.bodies.surfaces.tetrahedralize import gmsh_mesh, gmsh_session
from palpate.bodies.vtk_readers import SURFACES, is_polydata, read_surface
from palpate.bodies.whole_files import CUT, check_whole
from palpate.errors import InputError

MESHIO = {".vtk": "vtk", ".vtu": "vtu", ".mesh": "medit"}
# a gmsh file starts with one of these; gmsh would run anything else as a script
GMSH_HEADS = (b"$MeshFormat", b"$NOD", b"$Comments", b"$PhysicalNames")


@dataclass
class RawMesh:
    """Content of a file: points (n, 3) in its own unit, and elements by meshio's name for their type.

    solids, sheets : {type: (m, corners)}, three- and two-dimensional elements; points and lines are left out
    tags : of the tetrahedra, in their order; None if there are none
    """

    points: np.ndarray
    solids: dict[str, np.ndarray] = field(default_factory=dict)
    sheets: dict[str, np.ndarray] = field(default_factory=dict)
    tags: Tags | None = None


def read(path: Path) -> RawMesh:
    """Read a gmsh, VTK, VTU, medit, STL, OBJ, PLY or OFF file; raise InputError if that is impossible."""
    suffix = path.suffix.lower()
    if suffix not in (".msh", *MESHIO, *SURFACES):
        known = " ".join([".msh", *MESHIO, *SURFACES])
        raise InputError(f"{path}: its name does not show a mesh format; convert it to one of {known}.")
    if not path.is_file():
        raise InputError(f"{path}: this mesh file does not exist; correct the body's path.")
    try:
        data = path.read_bytes()
        check_whole(suffix, data)
        if suffix == ".msh":
            return _read_gmsh(path)
        if suffix in SURFACES or (suffix == ".vtk" and is_polydata(data)):
            points, triangles = read_surface(suffix, data)
            # where binary data are damaged, the coordinates show it first
            check_coordinates(str(path), points)
            if suffix == ".vtk" and not len(triangles):
                raise ValueError(CUT.format("it has points and no polygons"))
            return RawMesh(points, sheets={"triangle": triangles} if len(triangles) else {})
        return _read_meshio(path, MESHIO[suffix])
    except InputError:
        raise
    # a damaged file can make a reader raise any exception, and meshio may even exit
    except (Exception, SystemExit) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        if reason.startswith("it is cut off"):
            raise InputError(f"{path}: {reason}.") from error
        raise InputError(f"{path}: malformed {suffix} file ({reason}); write it again or convert it.") from error


def _read_gmsh(path: Path) -> RawMesh:
    """Read versions 1, 2 and 4, ASCII and binary; trap: nodes are numbered by increasing tag, not by position."""
    with path.open("rb") as file:
        if not file.read(64).lstrip().startswith(GMSH_HEADS):
            raise ValueError("it does not start like a gmsh mesh")
    with gmsh_session() as gmsh:
        # unlike open, merge ignores an options file beside the mesh
        gmsh.merge(str(path))
        points, elements = gmsh_mesh(gmsh)
        raw = RawMesh(points)
        for kind, corners in elements.items():
            label, dimension, *_ = gmsh.model.mesh.getElementProperties(kind)
            name = {"Tetrahedron 4": "tetra", "Triangle 3": "triangle", "Quadrilateral 4": "quad"}.get(label, label)
            _add_elements(raw, name, dimension, corners)
            if name == "tetra":
                raw.tags = gmsh_tags(gmsh, kind)
    return raw


def _read_meshio(path: Path, kind: str) -> RawMesh:
    """Read a file with the module of its format, since ``meshio.read`` exits on errors."""
    import importlib

    mesh = importlib.import_module(f"meshio.{kind}").read(str(path))
    raw = RawMesh(np.asarray(mesh.points, dtype=float).reshape(-1, 3))
    for block in mesh.cells:
        _add_elements(raw, block.type, block.dim, np.asarray(block.data))
    if "tetra" in raw.solids:
        raw.tags = cell_tags([block.type for block in mesh.cells], mesh.cell_data)
    return raw


def _add_elements(raw: RawMesh, name: str, dimension: int, corners: np.ndarray) -> None:
    if dimension < 2 or not len(corners):
        return
    blocks = raw.solids if dimension == 3 else raw.sheets
    corners = corners.astype(np.int64)
    blocks[name] = np.vstack([blocks[name], corners]) if name in blocks else corners
