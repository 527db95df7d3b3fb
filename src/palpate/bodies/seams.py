"""Seams of a tetrahedral mesh: pieces whose faces coincide are welded; faces that touch, nearly touch or overlap."""

import warnings

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.mesh import TetMesh, area_normals, components, edge_lengths, within
from palpate.bodies.surfaces.triangles import drop_unused
from palpate.errors import InputError

SAME = 1e-4
"""Distance up to which nodes are the same, as a share of the shortest edge at both."""
TOUCHING, NEAR_OF_WIDTH = 1e-3, 0.05
"""Distances, as shares of a face's width, up to which something before it touches it, and up to which it is near."""


MIDDLE, CORNER = np.array([0.3197, 0.3623, 0.3180]), np.array([0.9000, 0.0613, 0.0387])
"""Places on a face that is probed; faces of elements in regular meshes go through its very middle and its corners."""


def weld_pieces(nodes: np.ndarray, tetrahedra: np.ndarray) -> tuple[np.ndarray, np.ndarray, str]:
    """Weld the pieces of a mesh, (n, 3) and (m, 4), at boundary faces that coincide; also say that in words.

    The first of the nodes that coincide stays, and elements keep their order. Faces of one piece stay apart, as those
    of a cut are.
    """
    mesh = TetMesh(nodes, tetrahedra)
    piece, triangles = components(mesh.edges, len(nodes)), mesh.triangles
    first, second, group = _coinciding(mesh)
    across = piece[triangles[first, 0]] != piece[triangles[second, 0]]
    if not across.any():
        return nodes, tetrahedra, ""
    joined = np.unique(triangles[np.concatenate([first[across], second[across]])])
    _, kept, place = np.unique(group[joined], return_index=True, return_inverse=True)
    number = np.arange(len(nodes))
    number[joined] = joined[kept][place]
    pieces = len(np.unique(piece[joined]))
    said = f"{pieces} pieces welded at {len(kept)} nodes, whose faces coincide to {SAME:g} of an edge"
    return *drop_unused(nodes, number[tetrahedra]), said


def check_seams(source: str, mesh: TetMesh) -> None:
    """Raise InputError for elements that overlap and faces that touch without shared nodes; warn of those that may.

    Boundary faces are probed just below their middles and corners, and before their middles.
    """
    triangles = mesh.triangles
    first, second, _ = _coinciding(mesh)
    if len(first):
        warnings.warn(
            f"{source}: {len(first)} pairs of faces within one piece coincide and share no nodes; they are taken for a "
            "cut, whose lips come apart and pass through each other; merge their nodes if nothing is cut there.",
            stacklevel=3,
        )
    single = np.delete(triangles, np.concatenate([first, second]), axis=0)
    corners = mesh.nodes[single]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    # normals as long as a face is wide
    normals = area_normals(mesh.nodes, single) / edges.max(axis=1)[:, None]
    middles = np.tensordot(MIDDLE, corners, (0, 1))
    inner = [middles, *(np.tensordot(np.roll(CORNER, i), corners, (0, 1)) for i in range(3))]
    places = [
        *(each - TOUCHING * normals for each in inner),
        *(middles + s * normals for s in (TOUCHING, NEAR_OF_WIDTH)),
    ]
    place, _, weights = within(np.concatenate(places), mesh.nodes[mesh.tetrahedra])
    around = np.bincount(place[weights.min(axis=1) > 0.0], minlength=6 * len(single)).reshape(6, -1)
    faults = {
        "overlap with other elements": around[:4].max(axis=0) > 1,
        "touch others and share no nodes with them": around[4] > 0,
        f"are closer than {NEAR_OF_WIDTH:g} of their width to others, through which they pass": around[5] > 0,
    }
    for what, of in faults.items():
        if of.any():
            first_at = ", ".join(f"{x:.3g}" for x in middles[of][0])
            said = f"{source}: {of.sum()} of {len(triangles)} boundary faces {what} (first at ({first_at}) m); "
            if what.startswith("are"):
                warnings.warn(f"{said}merge the nodes there if the parts hold together.", stacklevel=3)
            else:
                raise InputError(f"{said}merge the nodes, mesh the parts together, or give each a file of its own.")


def _coinciding(mesh: TetMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pairs (k,), (k,) of boundary faces that coincide and face each other, and the nodes' places (n,)."""
    triangles, surface, edges = mesh.triangles, mesh.surface, mesh.edges
    shortest = np.full(len(mesh.nodes), np.inf)
    np.minimum.at(shortest, edges, edge_lengths(mesh.nodes, edges)[:, None])
    reach = SAME * shortest[surface]
    pairs = cKDTree(mesh.nodes[surface]).query_pairs(reach.max(initial=0.0), output_type="ndarray")
    same_place = edge_lengths(mesh.nodes, surface[pairs]) <= reach[pairs].min(axis=1)
    group = components(surface[pairs[same_place]], len(mesh.nodes))
    _, same, count = np.unique(np.sort(group[triangles], axis=1), axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(same, kind="stable")
    first, second = order[count[same[order]] == 2].reshape(-1, 2).T
    normals = area_normals(mesh.nodes, triangles)
    facing = np.einsum("ij,ij->i", normals[first], normals[second]) < 0
    return first[facing], second[facing], group
