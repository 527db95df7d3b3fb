"""Shape of a body in a mesh file: tetrahedra, or the triangles of a surface."""

from pathlib import Path

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_checks import check_coordinates, check_indices
from palpate.bodies.mesh_readers import RawMesh, read
from palpate.bodies.mesh_tags import tagged
from palpate.bodies.surfaces.weld import drop_unused, weld
from palpate.errors import InputError

# a surface with more nodes is remeshed unless the entry says otherwise
KEPT_NODES = 400


def load_shape(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Load what the body is made of: points (n, 3) [file's unit], triangles (m, 3), and tetrahedra (k, 4) or None.

    Of tetrahedra, the triangles are those of the boundary; the triangles of a surface are welded. Raises InputError if
    there is neither, or if there are other elements.
    Trap: nodes that no element uses are dropped, and the others are renumbered from 0 in the file's order.
    """
    raw = _read(path)
    others = sorted(set(raw.solids) - {"tetra"})
    if others:
        raise InputError(f"{path}: it has {', '.join(others)} elements; convert them all to 4-node tetrahedra.")
    if "tetra" in raw.solids:
        check_indices(str(path), "tetrahedra", raw.solids["tetra"], len(raw.points))
        nodes, tetrahedra = drop_unused(raw.points, raw.solids["tetra"])
        return nodes, TetMesh(nodes, tetrahedra).triangles, tetrahedra
    return *weld(raw.points, _triangles(path, raw)), None


def load_tagged(path: Path, tag: int | str) -> np.ndarray:
    """Load the numbers (k,) of the tetrahedra of a file that have a tag, in the order of ``load_shape``.

    tag : a number or a name; InputError if no tetrahedron has it
    """
    return tagged(path, _read(path).tags, tag)


def remeshed_by_default(points: np.ndarray, triangles: np.ndarray, tetrahedra: np.ndarray | None) -> bool:
    """Test whether a file's surface has so many nodes that it is remeshed unless the entry says otherwise."""
    return tetrahedra is None and len(points) > KEPT_NODES


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
