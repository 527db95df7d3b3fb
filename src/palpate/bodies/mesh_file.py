"""Read the points, triangles and tetrahedra of a body from a mesh file or a mesh of scikit-fem, and find its unit."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from palpate.bodies.ct.image import numbers_of
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import check_boundary, check_coordinates, check_indices, check_tetrahedra
from palpate.bodies.mesh_readers import RawMesh, read
from palpate.bodies.seams import check_seams
from palpate.bodies.settings import POSSIBLE_M
from palpate.bodies.surfaces.triangles import drop_unused, weld
from palpate.errors import InputError

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
    return next(iter(organ_sized(size, UNITS).items()), None)


def organ_sized(size: float, units: dict[str, float]) -> dict[str, float]:
    """Return those of ``units`` [m] in which a longest side of ``size`` is an organ's."""
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
    for unit, units_in_metre in (("m", 1.0), ("cm", 100.0), ("mm", 1e3)):
        if length_m * units_in_metre >= 1 and not (unit == "cm" and length_m < 0.1):
            break
    return f"{length_m * units_in_metre:.3g} {unit}"


# least extent of points over their largest up to which they lie in one plane
FLAT = 1e-6
# a surface with more nodes is remeshed unless the entry says otherwise
KEPT_NODES = 400


def load_shape(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Load a mesh file's points (n, 3) [file's unit], triangles (m, 3), and tetrahedra (k, 4) or None.

    The triangles are those of the tetrahedra's boundary; those of a file without tetrahedra are welded. Raises
    InputError if there is neither, or if there are other elements.
    Trap: nodes that no element uses are dropped, and the others are renumbered from 0 in the file's order.
    """
    raw = read(path)
    points = raw.points
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if len(points) > 3 else np.zeros(3)
    if len(points) and extents[2] <= FLAT * extents[0]:
        raise InputError(
            f"{path}: all of its points lie in one plane, so it encloses no body; give a closed surface or tetrahedra, "
            "or for a cloth a body of kind sheet."
        )
    other_kinds = sorted(set(raw.solids) - {"tetra"})
    if other_kinds:
        raise InputError(f"{path}: it has {', '.join(other_kinds)} elements; convert them all to 4-node tetrahedra.")
    if "tetra" in raw.solids:
        check_indices(str(path), "tetrahedra", raw.solids["tetra"], len(points))
        nodes, tetrahedra = drop_unused(points, raw.solids["tetra"])
        return nodes, TetMesh(nodes, tetrahedra).triangles, tetrahedra
    return *weld(points, _triangles(path, raw)), None


def load_tagged(path: Path, wanted: int | str) -> np.ndarray:
    """Load the numbers (k,) of the tetrahedra of a file that have a tag, in the order of ``load_shape``.

    wanted : the tag's number or name; InputError if no tetrahedron has it
    """
    tags = read(path).tags
    if tags is None:
        raise InputError(f"{path}: it has no tetrahedra and so no tags; give the region by a sphere.")
    if not tags.groups:
        raise InputError(f"{path}: {tags.fault}, or give the region by a sphere.")
    sizes = {tag: len(elements) for tag, elements in tags.groups.items()}
    number, *_ = numbers_of(f"{path}: no tetrahedron has the tag", wanted, sizes, tags.names, "{:g} tetrahedra".format)
    return tags.groups[number]


def load_surface(path: str | Path, scale_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Load points (n, 3) [m] and triangles (m, 3) of a surface file, welded; the surface may be open.

    Raises InputError if the file cannot be read or no triangle is left.
    """
    raw = read(Path(path))
    points, triangles = weld(scale_m * raw.points, _triangles(Path(path), raw))
    if not len(triangles):
        raise InputError(
            f"{path}: none of its triangles has three distinct corners with scale_m {scale_m:g}; "
            "give the length of the file's unit in metres, or export it again."
        )
    return points, triangles


def _triangles(path: Path, raw: RawMesh) -> np.ndarray:
    """Collect all triangles of a surface file, quadrilaterals cut in two."""
    other_kinds = sorted(set(raw.sheets) - {"triangle", "quad"})
    if other_kinds:
        raise InputError(f"{path}: it has {', '.join(other_kinds)} elements; convert them all to triangles.")
    if not raw.sheets:
        raise InputError(f"{path}: it has neither tetrahedra nor triangles; give a volume or a closed surface mesh.")
    triangles = raw.sheets.get("triangle", np.empty((0, 3), dtype=np.int64))
    quads = raw.sheets.get("quad", np.empty((0, 4), dtype=np.int64))
    triangles = np.vstack([triangles, quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    check_indices(str(path), "triangles", triangles, len(raw.points))
    return triangles


def checked(source: str, nodes: np.ndarray, tetrahedra: np.ndarray) -> TetMesh:
    """Return the mesh of given tetrahedra; InputError if elements or its boundary are bad, or faces touch unmerged."""
    mesh = TetMesh(nodes, check_tetrahedra(source, nodes, tetrahedra))
    check_boundary(source, mesh)
    check_seams(source, mesh)
    return mesh


def read_skfem(source: str, mesh: Any) -> TetMesh:
    """Return the tetrahedra of a ``MeshTet`` in metres, with their nodes in its order; InputError naming ``source``."""
    from skfem import ElementTetP1

    if getattr(mesh, "elem", None) is not ElementTetP1:
        kind = type(mesh).__name__
        raise InputError(
            f"{source}: a {kind} has no tetrahedra with 4 nodes alone; give a MeshTet, such as of its p, t."
        )
    nodes, corners = np.ascontiguousarray(mesh.p.T, dtype=float), np.ascontiguousarray(mesh.t.T, dtype=np.int64)
    check_coordinates(source, nodes)
    if len(unused := np.setdiff1d(np.arange(len(nodes)), corners)):
        raise InputError(
            f"{source}: {len(unused)} of {len(nodes)} nodes are of no tetrahedron (first: node {unused[0]}); give the "
            "mesh without them, such as mesh.remove_unused_nodes()."
        )
    size = float(np.ptp(nodes, axis=0).max())
    if not POSSIBLE_M[0] <= size <= POSSIBLE_M[1]:
        unit, scale = guess_scale(size) or ("millimetre", 1e-3)
        raise InputError(
            f"{source}: its longest side is {in_words(size)}, and bodies are {POSSIBLE_M[0]:g} to {POSSIBLE_M[1]:g} m "
            f"long here; give it in metres, as mesh.scaled({scale:g}) if its unit is the {unit}."
        )
    inverted = TetMesh(nodes, corners).volumes < 0.0
    corners[inverted] = corners[inverted][:, [0, 1, 3, 2]]  # scikit-fem sorts the nodes of its elements
    return checked(source, nodes, corners)
