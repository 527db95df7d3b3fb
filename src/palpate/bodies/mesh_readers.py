"""Readers of every accepted mesh format, into points, named blocks of elements and tags of tetrahedra."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.bodies.mesh_quality import check_coordinates
from palpate.bodies.surfaces.tetrahedralize import gmsh_mesh, gmsh_session
from palpate.bodies.vtk_readers import CUT, SURFACES, check_content, read_surface
from palpate.errors import InputError, suggest

KNOWN = ("gmsh:physical", "medit:ref", "CellEntityIds", "cell_tags", "region", "label")
"""Names of cell data that hold tags, in the order in which they are looked for; the second is medit's, the third that
of gmsh's VTK files."""
LISTED = 8
"""Tags that a message lists, most elements first."""


@dataclass
class Tags:
    """Groups of tetrahedra, which may overlap.

    groups : tag → numbers (k,) of tetrahedra in the file's order; names : of tags, as far as the file has them
    fault : why there are none, for a message
    """

    groups: dict[int, np.ndarray] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)
    fault: str = "its tetrahedra have no tags"


def gmsh_tags(gmsh: Any, kind: int) -> Tags:
    """Collect the elements of a type by physical group, or if no volume is in one, by the geometrical tag."""
    numbers = gmsh.model.mesh.getElementsByType(kind)[0]
    order = np.argsort(numbers)
    physical: dict[int, list[np.ndarray]] = {}
    geometrical: dict[int, list[np.ndarray]] = {}
    for _, volume in gmsh.model.getEntities(3):
        found = gmsh.model.mesh.getElementsByType(kind, volume)[0]
        places = order[np.searchsorted(numbers, found, sorter=order)]
        geometrical[int(volume)] = [places]
        for tag in gmsh.model.getPhysicalGroupsForEntity(3, volume):
            physical.setdefault(int(tag), []).append(places)
    names = {tag: name for tag in physical if (name := gmsh.model.getPhysicalName(3, tag))}
    groups = {tag: np.sort(np.concatenate(parts)) for tag, parts in (physical or geometrical).items()}
    return Tags({tag: found for tag, found in groups.items() if len(found)}, names)


def cell_tags(kinds: list[str], cell_data: dict[str, list]) -> Tags:
    """Take tags from the cell data of a VTK, VTU or medit file: whole numbers, one for each tetrahedron.

    kinds : meshio's name for the type of each block of cells; cell_data : name → one array for each block
    """
    found: dict[str, np.ndarray] = {}
    for name, blocks in cell_data.items():
        values = [np.asarray(block) for block, kind in zip(blocks, kinds, strict=True) if kind == "tetra"]
        if values and all(each.ndim == 1 and _are_whole(each) for each in values):
            found[name] = np.concatenate(values).astype(np.int64)
    key = next((name for name in KNOWN if name in found), next(iter(found), ""))
    if not key:
        return Tags()
    if len(found) > 1 and key not in KNOWN:
        return Tags(fault=f"its cell data {', '.join(sorted(found))} could all be tags; name the right one region")
    return Tags({int(tag): np.flatnonzero(found[key] == tag) for tag in np.unique(found[key])})


def tagged(path: Path, tags: Tags | None, wanted: int | str) -> np.ndarray:
    """Return the numbers (k,) of the tetrahedra with a tag, given by number or name; InputError if there are none."""
    if tags is None:
        raise InputError(f"{path}: it has no tetrahedra and so no tags; give the region by a sphere.")
    if not tags.groups:
        raise InputError(f"{path}: {tags.fault}, or give the region by a sphere.")
    for tag, elements in tags.groups.items():
        if wanted == (tags.names.get(tag) if isinstance(wanted, str) else tag):
            return elements
    guess = suggest(str(wanted), list(tags.names.values()), "") if isinstance(wanted, str) else ""
    near = f" ({guess})" if guess.startswith("did") else ""
    raise InputError(f"{path}: no tetrahedron has the tag {wanted}{near}; there are {_listed(tags)}.")


def _listed(tags: Tags) -> str:
    most = sorted(tags.groups, key=lambda tag: (-len(tags.groups[tag]), tag))
    said = [
        f"{tag} {tags.names.get(tag, '')}".strip() + f" ({len(tags.groups[tag])} tetrahedra)" for tag in most[:LISTED]
    ]
    more = f" and {len(most) - LISTED} more" if len(most) > LISTED else ""
    return ", ".join(said) + more


def _are_whole(values: np.ndarray) -> bool:
    return values.dtype.kind in "iu" or (values.dtype.kind == "f" and bool((values == np.round(values)).all()))


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
        check_content(suffix, data)
        if suffix == ".msh":
            return _read_gmsh(path)
        # a legacy VTK file holds a surface or an unstructured grid
        if suffix in SURFACES or (suffix == ".vtk" and b"DATASET POLYDATA" in data[:1024].upper()):
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
        if reason.startswith(("it is cut off", "it holds")):
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
