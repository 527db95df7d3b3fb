"""Reading of mesh files: points, elements and tags, turned from the frame that a header names to LPS."""

import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from palpate.bodies.mesh_quality import check_coordinates
from palpate.bodies.surface_files import CUT, SURFACES, check_content, read_surface, vtk_errors
from palpate.bodies.surfaces.tetrahedralize import gmsh_mesh, gmsh_session
from palpate.errors import InputError
from palpate.given_text import without_mark

KNOWN = ("gmsh:physical", "medit:ref", "cellentityids", "cell_tags", "region", "label")
"""Names of cell data that hold tags, in lower case, in the order in which they are looked for; the second is medit's,
the third that of gmsh's VTK files."""


@dataclass
class Tags:
    """Groups of tetrahedra, which may overlap.

    groups : tag → numbers (k,) of tetrahedra in the file's order; names : of tags, as far as the file has them
    fault : why there are none, for a message
    """

    groups: dict[int, np.ndarray] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)
    fault: str = "its tetrahedra have no tags"


def gmsh_tags(gmsh: Any, kind: int, kept: np.ndarray) -> Tags:
    """Collect the elements of a type by physical group, or if no volume is in one, by the tag of their volume.

    kept : (k,) the number that each of gmsh's k elements of this type has in the mesh that is read
    """
    numbers = gmsh.model.mesh.getElementsByType(kind)[0]
    order = np.argsort(numbers)
    physical: dict[int, list[np.ndarray]] = {}
    geometrical: dict[int, list[np.ndarray]] = {}
    for _, volume in gmsh.model.getEntities(3):
        elements = gmsh.model.mesh.getElementsByType(kind, volume)[0]
        kept_numbers = kept[order[np.searchsorted(numbers, elements, sorter=order)]]
        geometrical[int(volume)] = [kept_numbers]
        for tag in gmsh.model.getPhysicalGroupsForEntity(3, volume):
            physical.setdefault(int(tag), []).append(kept_numbers)
    names = {tag: name for tag in physical if (name := gmsh.model.getPhysicalName(3, tag))}
    groups = {tag: np.unique(np.concatenate(parts)) for tag, parts in (physical or geometrical).items()}
    return Tags({tag: elements for tag, elements in groups.items() if len(elements)}, names)


def cell_tags(cell_data: Mapping[str, np.ndarray]) -> Tags:
    """Return the tags of tetrahedra that a file's cell data hold: the array of whole numbers whose name says so.

    cell_data : name → values of the tetrahedra; arrays of another shape than (k,) and of fractions are no tags
    """
    numbers = {name: values for name, values in cell_data.items() if values.ndim == 1 and values.dtype.kind in "iuf"}
    integers = {name: values.astype(np.int64) for name, values in numbers.items() if (values == np.round(values)).all()}
    by_lower_name = {name.lower(): name for name in integers}
    name_of_tags = next((by_lower_name[name] for name in KNOWN if name in by_lower_name), next(iter(integers), ""))
    if not name_of_tags:
        return Tags()
    if len(integers) > 1 and name_of_tags.lower() not in KNOWN:
        return Tags(fault=f"its cell data {', '.join(sorted(integers))} could all be tags; name the right one region")
    return Tags({int(tag): np.flatnonzero(integers[name_of_tags] == tag) for tag in np.unique(integers[name_of_tags])})


VTK = (".vtk", ".vtu", ".vtp")
# a gmsh file starts with one of these; gmsh would run anything else as a script
GMSH_HEADS = (b"$MeshFormat", b"$NOD", b"$Comments", b"$PhysicalNames")
HEADER = 65536
"""Bytes of a file among which the frame is looked for."""
COARSE = 1e-3
"""Steps of single precision, as a share of the size, beyond which a mesh is refused."""


@dataclass
class RawMesh:
    """Content of a file: points (n, 3) in its own unit, and elements by meshio's name for their type.

    solids, sheets : {type: (m, corners)}, three- and two-dimensional elements; points and lines are left out
    tags : of the tetrahedra, in their order; None if there are none
    frame : that its header names, from which it is turned to LPS; None if it names none
    """

    points: np.ndarray
    solids: dict[str, np.ndarray] = field(default_factory=dict)
    sheets: dict[str, np.ndarray] = field(default_factory=dict)
    tags: Tags | None = None
    frame: str | None = None


def read(path: Path) -> RawMesh:
    """Read a gmsh, VTK, medit, STL, OBJ, PLY or OFF file; raise InputError if that is impossible.

    A mesh whose header says SPACE=RAS is turned to LPS, with a warning.
    """
    stat = path.stat() if path.is_file() else None
    return _read(path, (stat.st_mtime_ns, stat.st_size) if stat else None)


# its facts, its frame, its shape and its tags are asked for one after another
@lru_cache(maxsize=1)
def _read(path: Path, changed: tuple[int, int] | None) -> RawMesh:
    """Do as ``read``; changed : the file's time [ns] and size, by which the result is cached, None if it is missing."""
    suffix = path.suffix.lower()
    if suffix not in (known := (".msh", ".mesh", *VTK, *SURFACES)):
        raise InputError(f"{path}: its name does not show a mesh format; convert it to one of {' '.join(known)}.")
    if changed is None:
        raise InputError(f"{path}: this mesh file does not exist; correct the body's path.")
    try:
        data = without_mark(path.read_bytes())
        check_content(suffix, data)
        if suffix in SURFACES:
            points, triangles = read_surface(suffix, data)
            raw = RawMesh(points, sheets={"triangle": triangles} if len(triangles) else {})
        elif suffix in VTK:
            raw = _read_vtk(data)
        else:
            with TemporaryDirectory() as folder:
                copy = Path(folder) / f"mesh{suffix}"
                # of the first version, which is text as well, meshio reads points in single precision
                copy.write_bytes(re.sub(rb"^(MeshVersionFormatted\s+)1\b", rb"\g<1>2", data))
                raw = _read_gmsh(copy) if suffix == ".msh" else _read_medit(copy)
        _turn(path, raw, data[:HEADER])
    except InputError:
        raise
    # a damaged file can make a reader raise any exception, and meshio may even exit
    except (Exception, SystemExit) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        if reason.startswith(("it is cut off", "it holds")):
            raise InputError(f"{path}: {reason}.") from error
        raise InputError(f"{path}: malformed {suffix} file ({reason}); write it again or convert it.") from error
    check_coordinates(str(path), raw.points)
    _check_steps(path, raw.points)
    return raw


def _turn(path: Path, raw: RawMesh, header: bytes) -> None:
    """Turn a mesh to LPS from the frame that its header names as 3D Slicer writes it, SPACE=RAS."""
    named = {word.decode() for word in re.findall(rb"\bSPACE\s*=\s*([a-z-]+)", header, re.I)}
    frames = {word.upper() for word in (named | {raw.frame}) if word}
    if len(frames) > 1 or not frames <= {"LPS", "RAS"}:
        raise InputError(
            f"{path}: its header says SPACE={' and '.join(sorted(frames))}; write LPS or RAS there, or leave it out."
        )
    raw.frame = next(iter(frames), None)
    if raw.frame == "RAS":
        raw.points = raw.points * [-1.0, -1.0, 1.0]
        warnings.warn(
            f"{path}: its header says SPACE=RAS, so that it is turned to LPS, in which points of the configuration are "
            "(x to the patient's left, y to the back, z to the head); change the header if that is wrong.",
            stacklevel=3,
        )


def _check_steps(path: Path, points: np.ndarray) -> None:
    """Raise InputError if the points of a mesh are of single precision and too far from the origin for that."""
    if not len(points) or (points != points.astype(np.float32)).any():
        return
    size, step = np.ptp(points, axis=0).max(), float(np.spacing(np.float32(np.abs(points).max())))
    if step > COARSE * size > 0:
        raise InputError(
            f"{path}: its coordinates are of single precision, {step:.2g} units apart so far from the origin, for a "
            f"length of {size:.4g}; move it to the origin before it is written, or write it in double precision."
        )


def _read_gmsh(path: Path) -> RawMesh:
    """Read a gmsh file of version 1, 2 or 4, ASCII or binary; trap: nodes are numbered by tag, not by position.

    Version 2 repeats an element for each group that it is in; one of them is kept, which is in all groups.
    """
    data = path.read_bytes()
    if not data[:64].lstrip().startswith(GMSH_HEADS):
        raise ValueError("it does not start like a gmsh mesh")
    if b"$end" not in data.rstrip()[-40:].lower():
        raise ValueError(CUT.format("its last section has no end"))
    with gmsh_session() as gmsh:
        # unlike open, merge ignores an options file beside the mesh
        try:
            gmsh.merge(str(path))
        except Exception as error:  # gmsh raises nothing narrower
            raise ValueError("gmsh cannot load it") from error
        points, elements = gmsh_mesh(gmsh)
        raw = RawMesh(points)
        for kind, corners in elements.items():
            label, dimension, *_ = gmsh.model.mesh.getElementProperties(kind)
            name = {"Tetrahedron 4": "tetra", "Triangle 3": "triangle", "Quadrilateral 4": "quad"}.get(label, label)
            _, firsts, groups = np.unique(np.sort(corners, axis=1), axis=0, return_index=True, return_inverse=True)
            _add_elements(raw, name, dimension, corners[np.sort(firsts)])
            if name == "tetra":
                raw.tags = gmsh_tags(gmsh, kind, np.searchsorted(np.sort(firsts), firsts[groups]))
    return raw


def _read_medit(path: Path) -> RawMesh:
    """Read a medit file with meshio's module, since ``meshio.read`` exits on errors."""
    import meshio

    mesh = meshio.medit.read(str(path))
    raw = RawMesh(np.asarray(mesh.points, dtype=float).reshape(-1, 3))
    for block in mesh.cells:
        _add_elements(raw, block.type, block.dim, block.data)
    if "tetra" in raw.solids:
        blocks = zip(mesh.cells, mesh.cell_data["medit:ref"], strict=True)
        raw.tags = cell_tags({"medit:ref": np.concatenate([refs for block, refs in blocks if block.type == "tetra"])})
    return raw


def _read_vtk(data: bytes) -> RawMesh:
    """Read a legacy or an XML file by VTK, which knows all of their pieces, compressors and kinds of arrays."""
    import pyvista
    from vtkmodules.vtkCommonDataModel import vtkCellTypeUtilities
    from vtkmodules.vtkIOCore import vtkMemoryResourceStream
    from vtkmodules.vtkIOLegacy import vtkGenericDataObjectReader
    from vtkmodules.vtkIOXML import vtkXMLGenericDataObjectReader

    if data.lstrip().startswith(b"<"):
        if b"</VTKFile>" not in data[-200:]:
            raise ValueError(CUT.format("its last line is not </VTKFile>"))
        reader: Any = vtkXMLGenericDataObjectReader()
        stream = vtkMemoryResourceStream()
        stream.SetBuffer(data, len(data), True)
        reader.SetStream(stream)
        reader.ReadFromInputStreamOn()
    else:
        reader = vtkGenericDataObjectReader()
        reader.SetBinaryInputString(data, len(data))
        reader.ReadFromInputStringOn()
        reader.ReadAllScalarsOn()
        reader.ReadAllFieldsOn()
    with vtk_errors():
        reader.Update()
    dataset = pyvista.wrap(reader.GetOutput())
    if isinstance(dataset, pyvista.MultiBlock):
        dataset = dataset.combine()
    if not isinstance(dataset, (pyvista.PolyData, pyvista.UnstructuredGrid)):
        raise ValueError(
            f"it holds a dataset of kind {type(dataset).__name__}; write it as unstructured grid or polydata"
        )
    dataset.RemoveGhostCells()  # which several pieces have in common
    raw = RawMesh(np.asarray(dataset.points, dtype=float))
    if "SPACE" in dataset.field_data:
        raw.frame = str(dataset.field_data["SPACE"][0])
    if isinstance(dataset, pyvista.PolyData):
        faces = dataset.triangulate().regular_faces
        # VTK reads corners that are missing at the end as 0
        if not len(faces) or (faces == faces[:, :1]).all(axis=1).any():
            raise ValueError(CUT.format("it has points and no polygons, or fewer than it announces"))
        _add_elements(raw, "triangle", 2, faces)
        return raw
    counts = np.diff(dataset.cell_offsets)
    for kind in np.unique(dataset.celltypes).tolist():
        numbers, name = np.flatnonzero(dataset.celltypes == kind), pyvista.CellType(kind).name.lower()
        # polygons, of which no body is made, have various numbers of corners
        corners = dataset.cell_connectivity[dataset.cell_offsets[numbers, None] + np.arange(counts[numbers].min())]
        if name == "vertex" and corners.shape[1] > 1:  # the last type is cut to its first digit
            raise ValueError(CUT.format("its last cell is none"))
        _add_elements(raw, name, vtkCellTypeUtilities.GetDimension(kind), corners)
        if name == "tetra":
            names = [name for name in dataset.cell_data if name[:3] != "vtk"]
            raw.tags = cell_tags({name: np.asarray(dataset.cell_data[name])[numbers] for name in names})
    return raw


def _add_elements(raw: RawMesh, name: str, dimension: int, corners: np.ndarray) -> None:
    if dimension < 2 or not len(corners):
        return
    blocks = raw.solids if dimension == 3 else raw.sheets
    corners = np.asarray(corners, dtype=np.int64)
    blocks[name] = np.vstack([blocks[name], corners]) if name in blocks else corners
