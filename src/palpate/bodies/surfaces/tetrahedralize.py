"""Tetrahedra inside a closed triangulated surface, by gmsh, which keeps the surface as it is."""

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from palpate.bodies.mesh import TetMesh, components
from palpate.bodies.surfaces.triangles import mean_edge
from palpate.errors import InputError

# gmsh has one global state per process, so only one thread may use it
_LOCK = threading.Lock()
TRIANGLE, TETRAHEDRON = 2, 4
ACROSS = 4
"""Edges across a ball in which elements are to be small."""

Ball = tuple[np.ndarray, float]
"""A centre (3,) [m] and a radius [m]."""


@contextmanager
def gmsh_session() -> Iterator[Any]:
    """Open the gmsh library in a fresh, quiet, single-threaded state (so that its meshes repeat bit for bit).

    Trap: by default gmsh catches Ctrl-C, which only the main thread may do.
    """
    import gmsh

    with _LOCK:
        gmsh.initialize(argv=[], readConfigFiles=False, interruptible=False)
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.option.setNumber("General.NumThreads", 1)
            yield gmsh
        finally:
            gmsh.finalize()


def tetrahedralize(
    points: np.ndarray,
    triangles: np.ndarray,
    spacing_m: float | None = None,
    source: str = "surface",
    balls: Sequence[Ball] = (),
) -> TetMesh:
    """Tetrahedralise a closed surface; its points come first and its triangles are the mesh's boundary.

    points, triangles : (n, 3) [m] and (m, 3), closed and wound outward, hence inward around a cavity
    spacing_m : desired edge length inside; by default the surface's mean edge length
    balls : where elements are to be small enough to show a ball, as far as the surface's triangles allow
    source : name of the surface in the InputError that is raised if it cannot be filled, as when it intersects itself
    """
    if spacing_m is None:
        spacing_m = mean_edge(points, triangles)
    shells = _sort_shells(points, triangles, source)
    with gmsh_session() as gmsh:
        for option in ("MeshSizeMin", "MeshSizeMax"):
            gmsh.option.setNumber(f"Mesh.{option}", spacing_m)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        if balls:
            sizes = [(*ball, min(2.0 * ball[1] / ACROSS, spacing_m)) for ball in balls]
            gmsh.option.setNumber("Mesh.MeshSizeMin", min(size for _, _, size in sizes))
            set_sizes(gmsh, sizes, spacing_m)
        try:
            nodes, tetrahedra = _generate(gmsh, points, shells)
        except Exception as error:  # gmsh raises nothing narrower
            raise InputError(
                f"{source}: gmsh cannot fill the surface ({error}); repair it where it intersects or touches itself."
            ) from error
    mesh = TetMesh(nodes, tetrahedra)
    after, before = ({tuple(t) for t in np.sort(each, axis=1).tolist()} for each in (mesh.triangles, triangles))
    if not np.array_equal(nodes[: len(points)], points) or after != before:
        raise InputError(
            f"{source}: gmsh changed the surface to fill it; "
            "remesh it so that it has no needles and does not intersect itself."
        )
    return mesh


def _sort_shells(points: np.ndarray, triangles: np.ndarray, source: str) -> list[np.ndarray]:
    """List the outer shell's triangles, then those of each cavity."""
    shell_of_triangle = label_shells(triangles, len(points))
    shells = [triangles[shell_of_triangle == number] for number in np.unique(shell_of_triangle)]
    # six times the volume inside, negative if wound inward
    volumes = [np.linalg.det(points[shell]).sum() for shell in shells]
    if sum(volume > 0 for volume in volumes) > 1:
        raise InputError(
            f"{source}: the surface has {len(shells)} separate shells; give each body a file of its own, and "
            "wind the triangles around a cavity inward."
        )
    return [shells[i] for i in np.argsort(volumes)[::-1]]


def label_shells(triangles: np.ndarray, n_points: int) -> np.ndarray:
    """Label each triangle with its connected piece of the surface, (n_triangles,)."""
    return components(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]]]), n_points)[triangles[:, 0]]


def gmsh_mesh(gmsh: Any) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Read the current model's nodes by increasing tag, (n, 3), and elements, {type number: (m, corners)}."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    elements = {}
    for kind in gmsh.model.mesh.getElementTypes():
        node_count = gmsh.model.mesh.getElementProperties(kind)[3]
        nodes_of_elements = gmsh.model.mesh.getElementsByType(kind)[1].reshape(-1, node_count)
        elements[int(kind)] = np.searchsorted(tags[order], nodes_of_elements).astype(np.int64)
    return coordinates.reshape(-1, 3)[order], elements


def set_sizes(gmsh: Any, balls: Sequence[tuple[np.ndarray, float, float]], far_m: float) -> None:
    """Ask for edges of a length in each ball, given by centre (3,), radius and this length [m]; of ``far_m`` beyond.

    Lengths grow within a radius around each ball.
    """
    fields = []
    for center, radius, size in balls:
        fields.append(gmsh.model.mesh.field.add("Ball"))
        numbers = dict(zip(("XCenter", "YCenter", "ZCenter"), map(float, center), strict=True))
        numbers |= {"Radius": radius, "Thickness": radius, "VIn": size, "VOut": far_m}
        for name, value in numbers.items():
            gmsh.model.mesh.field.setNumber(fields[-1], name, value)
    smallest = gmsh.model.mesh.field.add("Min")
    gmsh.model.mesh.field.setNumbers(smallest, "FieldsList", fields)
    gmsh.model.mesh.field.setAsBackgroundMesh(smallest)


def _generate(gmsh: Any, points: np.ndarray, shells: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Fill the volume between ``shells`` by gmsh: nodes (n, 3), the points first, and tetrahedra (m, 4)."""
    loops = []
    for shell in shells:
        surface = gmsh.model.addDiscreteEntity(2)
        shell_nodes = np.unique(shell)
        gmsh.model.mesh.addNodes(2, surface, shell_nodes + 1, points[shell_nodes].ravel())
        gmsh.model.mesh.addElementsByType(surface, TRIANGLE, [], (shell + 1).ravel())
        loops.append(gmsh.model.geo.addSurfaceLoop([surface]))
    gmsh.model.geo.addVolume(loops)
    gmsh.model.geo.synchronize()
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.optimize("Netgen", niter=3)
    points, elements = gmsh_mesh(gmsh)
    return points, elements[TETRAHEDRON]
