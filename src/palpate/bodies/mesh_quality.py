"""Checks of a mesh, each of which raises InputError, and tables of its elements' shapes and counts."""

import warnings
from collections.abc import Sequence

import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.bodies.mesh import EDGES, FACES, Mesh, TetMesh, components, corner_normals, unit
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
    _, first_copy, copies = np.unique(np.sort(tetrahedra, axis=1), axis=0, return_index=True, return_counts=True)
    if copies.max() > 1:
        raise InputError(
            f"{source}: {(copies - 1).sum()} of {len(tetrahedra)} tetrahedra are duplicates "
            f"(first: of element {first_copy[copies > 1].min()}); remove them."
        )
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
    distinct, element_count = np.unique(faces, axis=0, return_counts=True)
    if element_count.max() > 2:
        face = distinct[np.argmax(element_count)].tolist()
        raise InputError(
            f"{source}: more than two tetrahedra share the face of nodes {face}; remove the elements that overlap."
        )
    _check_manifold(source, mesh.triangles)


def check_closed(source: str, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Check that a surface is closed, manifold and consistently wound; return its triangles, (m, 3), outward."""
    if not is_closed(triangles):
        raise InputError(
            f"{source}: the surface is not closed, or neighbouring triangles are wound opposite ways; close it and "
            "make the normals consistent, for instance in MeshLab."
        )
    _check_manifold(source, triangles)
    return triangles if np.linalg.det(points[triangles]).sum() > 0 else triangles[:, ::-1]


def is_closed(triangles: np.ndarray) -> bool:
    """Return whether triangles (m, 3) pass each edge as often in one sense as in the other, so that they enclose."""
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edge = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)[1].ravel()
    return len(triangles) > 0 and not np.bincount(edge, np.sign(ends[:, 1] - ends[:, 0])).any()


def check_indices(source: str, kind: str, elements: np.ndarray, count: int) -> None:
    """Check that elements refer to nodes that exist."""
    bad = np.flatnonzero(((elements < 0) | (elements >= count)).any(axis=1))
    if len(bad):
        raise InputError(
            f"{source}: {len(bad)} {kind} refer to nodes that do not exist "
            f"(first: element {bad[0]}, of {count} nodes); write the file again."
        )


def _check_manifold(source: str, triangles: np.ndarray) -> None:
    """Check that every edge of a closed surface has two triangles, and every node one fan of them."""
    sides = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges, edge_of_side, count = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    if count.max() > 2:
        edge = edges[np.argmax(count)].tolist()
        raise InputError(
            f"{source}: the surface is not a manifold at the edge of nodes {edge}, where {count.max()} "
            "triangles meet; separate or join the parts that touch there."
        )
    # corner k of triangle t is 3 t + k; the two triangles at an edge join their corners at each of its ends
    joined = np.column_stack([np.arange(len(sides)), np.arange(len(sides)) // 3 * 3 + (np.arange(len(sides)) + 1) % 3])
    joined = np.where(sides[:, :1] < sides[:, 1:], joined, joined[:, ::-1])
    pairs = joined[np.argsort(edge_of_side, kind="stable")].reshape(-1, 2, 2)
    links = pairs.transpose(0, 2, 1).reshape(-1, 2)
    nodes_of_fans = np.unique(np.column_stack([triangles.ravel(), components(links, len(sides))]), axis=0)[:, 0]
    pinched = nodes_of_fans[:-1][nodes_of_fans[:-1] == nodes_of_fans[1:]]
    if len(pinched):
        raise InputError(
            f"{source}: the surface is not a manifold at node {pinched[0]}, where parts touch at a point "
            "only; separate or join them."
        )


# dihedral angles [°] below which elements are reported, and below which a body is refused
LEAST_DEG, REFUSED_DEG = 10.0, 1.0


def quality(mesh: TetMesh) -> dict[str, float]:
    """Compute the extreme dihedral angles [°], smallest radius ratio (1 is a regular tetrahedron), volume [m³]."""
    angles = dihedral_angles(mesh)
    return {
        "min_dihedral_deg": float(angles.min()),
        "max_dihedral_deg": float(angles.max()),
        "min_radius_ratio": float(radius_ratios(mesh).min()),
        "volume_m3": float(mesh.volumes.sum()),
    }


def check_quality(levels: Sequence[Mesh], remedy: str) -> None:
    """Warn of elements with small dihedral angles on any level; InputError below 1°, where results mean nothing."""
    for level, mesh in enumerate(levels):
        if not isinstance(mesh, TetMesh):
            continue
        angles = dihedral_angles(mesh).min(axis=1)
        bad = int((angles < LEAST_DEG).sum())
        if not bad:
            continue
        sentence = (
            f"{bad} of {len(angles)} elements of level {level} have dihedral angles below {LEAST_DEG:g}° "
            f"(the smallest: {angles.min():.2g}°), which makes results there unreliable; {remedy}."
        )
        if angles.min() < REFUSED_DEG:
            raise InputError(sentence)
        warnings.warn(sentence, stacklevel=3)
        return


def dihedral_angles(mesh: TetMesh) -> np.ndarray:
    """Compute the angles inside each element along its six edges, (n_tetrahedra, 6) [°]."""
    normals = unit(corner_normals(mesh.nodes[mesh.tetrahedra][:, FACES]))
    one_normal, other_normal = normals[:, EDGES[:, 0]], normals[:, EDGES[:, 1]]
    # atan2 keeps its accuracy where the arc cosine of nearly ±1 loses it
    sine = np.linalg.norm(np.cross(one_normal, other_normal), axis=2)
    return np.degrees(np.arctan2(sine, -(one_normal * other_normal).sum(axis=2)))


def radius_ratios(mesh: TetMesh) -> np.ndarray:
    """Compute three times inradius over circumradius, (n_tetrahedra,)."""
    corners = mesh.nodes[mesh.tetrahedra]
    areas = np.linalg.norm(corner_normals(corners[:, FACES]), axis=2) / 2
    inradius = 3 * np.abs(mesh.volumes) / areas.sum(axis=1)
    edges = corners[:, 1:] - corners[:, :1]
    centre = np.linalg.solve(2 * edges, (edges**2).sum(axis=2)[..., None])[..., 0]
    return 3 * inradius / np.linalg.norm(centre, axis=1)


def mesh_quality(body: Body) -> pd.DataFrame:
    """Tabulate body, level, min_dihedral_deg, max_dihedral_deg, min_radius_ratio, volume_m3 of levels of tetrahedra."""
    meshes = [mesh for mesh in body.levels if isinstance(mesh, TetMesh)]
    rows = [{"body": body.name, "level": i, **quality(mesh)} for i, mesh in enumerate(meshes)]
    return pd.DataFrame(rows)


def mesh_sizes(body: Body, paper_surface: Sequence | None = None) -> pd.DataFrame:
    """Tabulate each level's counts, beside those of the paper's mesh table where the paper gives them.

    paper_surface : (nodes, triangles) or None for each level
    """
    paper_rows, rows = paper_surface or [None] * len(body.levels), []
    for level, (mesh, paper) in enumerate(zip(body.levels, paper_rows, strict=True)):
        counts = len(mesh.surface), len(mesh.triangles), len(mesh.nodes), len(mesh.tetrahedra)
        rows.append((body.name, level, *counts, *(paper or (pd.NA, pd.NA))))
    names = "body level surface_nodes surface_triangles nodes tetrahedra paper_nodes paper_triangles"
    return pd.DataFrame(rows, columns=names.split()).astype({"paper_nodes": "Int64", "paper_triangles": "Int64"})
