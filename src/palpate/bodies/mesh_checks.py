"""Checks of a mesh before it is used; each raises InputError with one sentence."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from palpate.bodies.mesh import FACES, TetMesh
from palpate.errors import InputError

# larger coordinates are damaged files: a wrong byte order gives finite numbers up to 1e38
LARGEST = 1e9
# a volume below this fraction of the cube of the longest edge is zero up to rounding
FLAT = 1e-10


def check_coordinates(source: str, points: np.ndarray) -> None:
    """Check that every coordinate is finite and of a plausible size."""
    bad = np.flatnonzero(~(np.abs(points) <= LARGEST).all(axis=1))
    if len(bad):
        raise InputError(
            f"{source}: {len(bad)} of {len(points)} nodes have NaN, infinite or absurdly large coordinates "
            f"(first: node {bad[0]}); repair the file or export it again."
        )


def check_tetrahedra(source: str, nodes: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Check that no element is flat, duplicate or inverted, and return them, (m, 4), positively oriented.

    Some programs number all elements the other way round: if every one is inverted, all are reversed.
    """
    check_indices(source, "tetrahedra", tetrahedra, len(nodes))
    _check_unique(source, "tetrahedra", tetrahedra)
    longest = np.ptp(nodes[tetrahedra], axis=1).max(axis=1)
    volumes = TetMesh(nodes, tetrahedra).volumes
    flat = np.flatnonzero(np.abs(volumes) <= FLAT * longest**3)
    if len(flat):
        raise InputError(
            f"{source}: {len(flat)} of {len(tetrahedra)} tetrahedra have no volume "
            f"(first: element {flat[0]}); remove them or remesh the body."
        )
    inverted = np.flatnonzero(volumes < 0)
    if len(inverted) == len(tetrahedra):
        return tetrahedra[:, [1, 0, 2, 3]]
    if len(inverted):
        raise InputError(
            f"{source}: {len(inverted)} of {len(tetrahedra)} tetrahedra are inverted "
            f"(first: element {inverted[0]}); repair the mesh or give all elements the same orientation."
        )
    return tetrahedra


def check_boundary(source: str, mesh: TetMesh) -> None:
    """Check that no face has more than two elements, and none touch only along an edge or at a node."""
    faces = np.sort(mesh.tetrahedra[:, FACES].reshape(-1, 3), axis=1)
    kinds, count = np.unique(faces, axis=0, return_counts=True)
    if count.max() > 2:
        face = kinds[np.argmax(count)].tolist()
        raise InputError(
            f"{source}: more than two tetrahedra share the face of nodes {face}; remove the elements that overlap."
        )
    _check_manifold(source, mesh.triangles)


def check_closed(source: str, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Check that a surface is closed, manifold and consistently wound; return its triangles, (m, 3), outward."""
    if len(triangles) < 4:
        raise InputError(f"{source}: its surface has {len(triangles)} triangles; give a closed surface.")
    check_indices(source, "triangles", triangles, len(points))
    _check_unique(source, "triangles", triangles)
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges, count = np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)
    opened = edges[count == 1]
    if len(opened):
        raise InputError(
            f"{source}: the surface has holes ({len(opened)} open edges, first: between points "
            f"{opened[0, 0]} and {opened[0, 1]}); close them, for instance in MeshLab."
        )
    _check_manifold(source, triangles)
    twice = len(ends) - len(np.unique(ends, axis=0))
    if twice:
        raise InputError(
            f"{source}: neighbouring triangles are wound opposite ways at {twice} edges; "
            "make the normals consistent, for instance in MeshLab."
        )
    a, b, c = (points[triangles[:, i]] for i in range(3))
    volume = np.einsum("ij,ij->", np.cross(a, b), c)
    return triangles if volume > 0 else triangles[:, ::-1]


def check_indices(source: str, kind: str, elements: np.ndarray, count: int) -> None:
    """Check that elements refer to nodes that exist."""
    bad = np.flatnonzero(((elements < 0) | (elements >= count)).any(axis=1))
    if len(bad):
        raise InputError(
            f"{source}: {len(bad)} {kind} refer to nodes that do not exist "
            f"(first: element {bad[0]}, of {count} nodes); write the file again."
        )


def _check_unique(source: str, kind: str, elements: np.ndarray) -> None:
    _, first, count = np.unique(np.sort(elements, axis=1), axis=0, return_index=True, return_counts=True)
    extra = int((count - 1).sum())
    if extra:
        raise InputError(
            f"{source}: {extra} of {len(elements)} {kind} are duplicates "
            f"(first: of element {first[count > 1].min()}); remove them."
        )


def _check_manifold(source: str, triangles: np.ndarray) -> None:
    """Check that every edge of a closed surface has two triangles, and every node one fan of them."""
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges, inverse, count = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)
    if count.max() > 2:
        edge = edges[np.argmax(count)].tolist()
        raise InputError(
            f"{source}: the surface is not a manifold at the edge of nodes {edge}, where {count.max()} "
            "triangles meet; separate or join the parts that touch there."
        )
    # corner k of triangle t is 3 t + k; the two triangles at an edge join their corners at each of its ends
    corner = np.column_stack([np.arange(len(ends)), np.arange(len(ends)) // 3 * 3 + (np.arange(len(ends)) + 1) % 3])
    corner = np.where(ends[:, :1] < ends[:, 1:], corner, corner[:, ::-1])
    pairs = corner[np.argsort(inverse, kind="stable")].reshape(-1, 2, 2)
    links = pairs.transpose(0, 2, 1).reshape(-1, 2)
    graph = sparse.coo_array((np.ones(len(links)), links.T), shape=(len(ends), len(ends)))
    fan = connected_components(graph, directed=False)[1]
    fans = np.unique(np.column_stack([triangles.ravel(), fan]), axis=0)[:, 0]
    pinched = fans[:-1][fans[:-1] == fans[1:]]
    if len(pinched):
        raise InputError(
            f"{source}: the surface is not a manifold at node {pinched[0]}, where parts touch at a point "
            "only; separate or join them."
        )
