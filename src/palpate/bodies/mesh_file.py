"""What a mesh file holds: points, elements, tags; its unit and shape; whether it is remeshed."""

import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import check_coordinates, check_indices
from palpate.bodies.settings import POSSIBLE_M
from palpate.bodies.surfaces.tetrahedralize import gmsh_mesh, gmsh_session
from palpate.bodies.surfaces.triangles import drop_unused, weld
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


# an organ's longest side [m]: from a gland to a stomach or a pair of lungs
ORGAN_M = (0.02, 0.6)
# in this order, since files in millimetres are the most frequent: 20 to 60 units could also be centimetres
UNITS = {"millimetre": 1e-3, "centimetre": 1e-2, "metre": 1.0, "micrometre": 1e-6}
# units that are never guessed, and may be meant
RARE_UNITS = {"inch": 0.0254}
# sizes [m] that a given scale may make without a warning
USUAL_M = (0.01, 1.0)


def guess_scale(size: float) -> tuple[str, float] | None:
    """Guess the unit in which a longest side of ``size`` units is an organ's: name and length [m]; None if none is."""
    return next(iter(_organ_sized(size, UNITS).items()), None)


def other_units(size: float, taken_m: float) -> dict[str, float]:
    """Return the units but that of ``taken_m`` [m] in which a longest side of ``size`` is an organ's: lengths [m]."""
    return {name: scale for name, scale in _organ_sized(size, UNITS | RARE_UNITS).items() if scale != taken_m}


def _organ_sized(size: float, units: dict[str, float]) -> dict[str, float]:
    low, high = ORGAN_M
    return {name: scale for name, scale in units.items() if low <= size * scale <= high}


def choose_scale(source: str, points: np.ndarray, scale_m: float | None) -> float:
    """Check the given length of the file's unit [m], or guess it from the points, (n, 3), and warn of the guess.

    Raises InputError if no guess is plausible, or if the given scale makes a body that no organ can be.
    """
    size = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    guess = guess_scale(size)
    if scale_m is None:
        if guess is None:
            example = f"{0.2 / size:.3g} makes it 20 cm long" if size > 0 else "such as 0.001 for millimetres"
            raise InputError(
                f"{source}: its longest side is {size:.4g} units, which is an organ's size neither in millimetres nor "
                f"in centimetres or metres; give scale_m, the length of the file's unit in metres ({example})."
            )
        name, scale = guess
        warnings.warn(
            f"{source}: scale_m is not given; its unit is taken for the {name}, which makes the body "
            f"{in_words(size * scale)} long; give scale_m: {scale:g} if that is right, or the unit's length in metres.",
            stacklevel=2,
        )
        return scale
    if not 0 < scale_m < np.inf:
        raise InputError(f"{source}: scale_m is {scale_m}; give the length of the file's unit in metres.")
    likely = f"if its unit is the {guess[0]}, give scale_m: {guess[1]:g}" if guess else "check scale_m"
    if not POSSIBLE_M[0] <= size * scale_m <= POSSIBLE_M[1]:
        raise InputError(f"{source}: scale_m {scale_m:g} makes a body {in_words(size * scale_m)} long; {likely}.")
    if not USUAL_M[0] <= size * scale_m <= USUAL_M[1]:
        warnings.warn(
            f"{source}: scale_m {scale_m:g} makes a body {in_words(size * scale_m)} long, which no organ is; {likely}.",
            stacklevel=3,
        )
    return scale_m


def in_words(length_m: float) -> str:
    """Write a length with the unit that suits it, such as "82 mm"."""
    for unit, factor in (("m", 1.0), ("cm", 100.0), ("mm", 1e3)):
        if length_m * factor >= 1 and not (unit == "cm" and length_m < 0.1):
            break
    return f"{length_m * factor:.3g} {unit}"


# least extent of points over their largest up to which they lie in one plane
FLAT = 1e-6
# a surface with more nodes is remeshed unless the entry says otherwise
KEPT_NODES = 400


def load_shape(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Load what the body is made of: points (n, 3) [file's unit], triangles (m, 3), and tetrahedra (k, 4) or None.

    Of tetrahedra, the triangles are those of the boundary; the triangles of a surface are welded. Raises InputError if
    there is neither, or if there are other elements.
    Trap: nodes that no element uses are dropped, and the others are renumbered from 0 in the file's order.
    """
    raw = _read(path)
    points = raw.points
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if len(points) > 3 else np.zeros(3)
    if len(points) and extents[2] <= FLAT * extents[0]:
        raise InputError(
            f"{path}: all of its points lie in one plane, so it encloses no body; give a closed surface or tetrahedra, "
            "or for a cloth a body of kind sheet."
        )
    others = sorted(set(raw.solids) - {"tetra"})
    if others:
        raise InputError(f"{path}: it has {', '.join(others)} elements; convert them all to 4-node tetrahedra.")
    if "tetra" in raw.solids:
        check_indices(str(path), "tetrahedra", raw.solids["tetra"], len(points))
        nodes, tetrahedra = drop_unused(points, raw.solids["tetra"])
        return nodes, TetMesh(nodes, tetrahedra).triangles, tetrahedra
    return *weld(points, _triangles(path, raw)), None


def load_tagged(path: Path, tag: int | str) -> np.ndarray:
    """Load the numbers (k,) of the tetrahedra of a file that have a tag, in the order of ``load_shape``.

    tag : a number or a name; InputError if no tetrahedron has it
    """
    return tagged(path, _read(path).tags, tag)


def load_surface(path: str | Path, scale_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Load points (n, 3) [m] and triangles (m, 3) of a surface file, welded; the surface may be open.

    Raises InputError if the file cannot be read or no triangle is left.
    """
    raw = _read(Path(path))
    points, triangles = weld(scale_m * raw.points, _triangles(Path(path), raw))
    if not len(triangles):
        raise InputError(
            f"{path}: none of its triangles has three distinct corners with scale_m {scale_m:g}; "
            "give the length of the file's unit in metres, or export it again."
        )
    return points, triangles


def _read(path: Path) -> RawMesh:
    raw = read(path)
    check_coordinates(str(path), raw.points)
    return raw


def _triangles(path: Path, raw: RawMesh) -> np.ndarray:
    """Collect all triangles of a surface file, quadrilaterals cut in two."""
    others = sorted(set(raw.sheets) - {"triangle", "quad"})
    if others:
        raise InputError(f"{path}: it has {', '.join(others)} elements; convert them all to triangles.")
    if not raw.sheets:
        raise InputError(f"{path}: it has neither tetrahedra nor triangles; give a volume or a closed surface mesh.")
    triangles = raw.sheets.get("triangle", np.empty((0, 3), dtype=np.int64))
    quads = raw.sheets.get("quad", np.empty((0, 4), dtype=np.int64))
    triangles = np.vstack([triangles, quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    check_indices(str(path), "triangles", triangles, len(raw.points))
    return triangles


@dataclass(frozen=True)
class MeshFacts:
    """Content of a mesh file and what is assumed of it.

    kind : ``surface`` or ``tetrahedra``
    nodes, triangles, tetrahedra : counts; of a surface, the tetrahedra are 0; of tetrahedra, the triangles are those
        of the boundary and the nodes include the inner ones
    size : longest side of the bounding box [file's unit]
    scale_m : guessed length of the file's unit [m]; None if no unit makes it an organ's size
    remeshed : whether its surface is remeshed unless ``surface_nodes`` says otherwise
    """

    kind: str
    nodes: int
    triangles: int
    tetrahedra: int
    size: float
    scale_m: float | None
    remeshed: bool


def inspect(path: str | Path) -> MeshFacts:
    """Collect the facts of a mesh file; raise InputError if it cannot be read or holds no body."""
    points, triangles, tetrahedra = load_shape(Path(path))
    size = float(np.ptp(points, axis=0).max())
    guess = guess_scale(size)
    return MeshFacts(
        "surface" if tetrahedra is None else "tetrahedra",
        len(points),
        len(triangles),
        0 if tetrahedra is None else len(tetrahedra),
        size,
        guess[1] if guess else None,
        tetrahedra is None and len(points) > KEPT_NODES,
    )
