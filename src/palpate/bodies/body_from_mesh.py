"""Bodies from mesh files: tetrahedra as they are, closed surfaces filled with tetrahedra."""

from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_checks import check_boundary, check_closed, check_coordinates, check_indices, check_tetrahedra
from palpate.bodies.mesh_readers import RawMesh, read
from palpate.bodies.surfaces.tetrahedralize import tetrahedralize
from palpate.bodies.units import choose_scale
from palpate.errors import InputError

# points closer than this fraction of the size are merged: an STL file repeats each corner, in single precision
WELD = 1e-6
# a surface with more nodes is remeshed unless the entry says otherwise
KEPT_NODES = 400


def load_file(path: str | Path, scale_m: float | None = None, spacing_m: float | None = None) -> TetMesh:
    """Load the body in a mesh file and check it; ``scale_m`` is the length of the file's unit in metres.

    A file with tetrahedra gives those: its points, lines, triangles and quadrilaterals are ignored, but other solid
    elements are an error, since the body would have gaps. A file with triangles or quadrilaterals only is a closed
    surface, welded and filled with an edge length of about ``spacing_m``.
    Trap: nodes that no element uses are dropped, and the others are renumbered from 0 in the file's order.
    """
    path = Path(path)
    points, triangles, tetrahedra = shape_of(path, _read(path))
    points = points * choose_scale(str(path), points, scale_m)
    if tetrahedra is not None:
        mesh = TetMesh(points, check_tetrahedra(str(path), points, tetrahedra))
        check_boundary(str(path), mesh)
        return mesh
    return tetrahedralize(points, check_closed(str(path), points, triangles), spacing_m, source=str(path))


def shape_of(path: Path, raw: RawMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Pick what the body is made of: points (n, 3), triangles (m, 3), and tetrahedra (k, 4) or None.

    Of tetrahedra, the triangles are those of the boundary; the triangles of a surface are welded. Raises InputError if
    there is neither, or if there are other elements.
    """
    others = sorted(set(raw.solids) - {"tetra"})
    if others:
        raise InputError(f"{path}: it has {', '.join(others)} elements; convert them all to 4-node tetrahedra.")
    if "tetra" in raw.solids:
        check_indices(str(path), "tetrahedra", raw.solids["tetra"], len(raw.points))
        nodes, tetrahedra = _drop_unused(raw.points, raw.solids["tetra"])
        return nodes, TetMesh(nodes, tetrahedra).triangles, tetrahedra
    return *weld(raw.points, _triangles(path, raw)), None


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


def weld(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Merge coinciding points; drop the triangles that this degenerates and the points that none uses."""
    tolerance = WELD * np.ptp(points, axis=0).max()
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points), len(points)))
    group = connected_components(graph, directed=False)[1]
    first = np.unique(group, return_index=True)[1]
    triangles = first[group][triangles]
    a, b, c = triangles.T
    return _drop_unused(points, triangles[(a != b) & (b != c) & (c != a)])


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


def _drop_unused(points: np.ndarray, elements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    used = np.unique(elements)
    return np.ascontiguousarray(points[used]), np.searchsorted(used, elements)
