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

    Of nodes that coincide the lowest stays, and elements keep their order. Coinciding faces of one piece stay apart, as
    they may be the lips of a cut.
    """
    mesh = TetMesh(nodes, tetrahedra)
    piece, triangles = components(mesh.edges, len(nodes)), mesh.triangles
    one_face, other_face, place_of_node = _coinciding(mesh)
    between_pieces = piece[triangles[one_face, 0]] != piece[triangles[other_face, 0]]
    if not between_pieces.any():
        return nodes, tetrahedra, ""
    joined = np.unique(triangles[np.concatenate([one_face[between_pieces], other_face[between_pieces]])])
    _, first_node, place_number = np.unique(place_of_node[joined], return_index=True, return_inverse=True)
    new_number = np.arange(len(nodes))
    new_number[joined] = joined[first_node][place_number]
    pieces = len(np.unique(piece[joined]))
    sentence = f"{pieces} pieces welded at {len(first_node)} nodes, whose faces coincide to {SAME:g} of an edge"
    return *drop_unused(nodes, new_number[tetrahedra]), sentence


def check_seams(source: str, mesh: TetMesh) -> None:
    """Raise InputError for elements that overlap and faces that touch without shared nodes; warn of those that may.

    Boundary faces are probed just below their middles and corners, and before their middles.
    """
    triangles = mesh.triangles
    one, other, _ = _coinciding(mesh)
    if len(one):
        warnings.warn(
            f"{source}: {len(one)} pairs of faces within one piece coincide and share no nodes; they are taken for a "
            "cut, whose lips come apart and pass through each other; merge their nodes if nothing is cut there.",
            stacklevel=3,
        )
    unpaired = np.delete(triangles, np.concatenate([one, other]), axis=0)
    corners = mesh.nodes[unpaired]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    # normals as long as a face is wide
    normals = area_normals(mesh.nodes, unpaired) / edges.max(axis=1)[:, None]
    middles = np.tensordot(MIDDLE, corners, (0, 1))
    probed = [middles, *(np.tensordot(np.roll(CORNER, i), corners, (0, 1)) for i in range(3))]
    places = [
        *(each - TOUCHING * normals for each in probed),
        *(middles + s * normals for s in (TOUCHING, NEAR_OF_WIDTH)),
    ]
    place, _, weights = within(np.concatenate(places), mesh.nodes[mesh.tetrahedra])
    elements_at = np.bincount(place[weights.min(axis=1) > 0.0], minlength=6 * len(unpaired)).reshape(6, -1)
    faults = {
        "overlap with other elements": elements_at[:4].max(axis=0) > 1,
        "touch others and share no nodes with them": elements_at[4] > 0,
        f"are closer than {NEAR_OF_WIDTH:g} of their width to others, through which they pass": elements_at[5] > 0,
    }
    for fault, bad in faults.items():
        if bad.any():
            first_at = ", ".join(f"{x:.3g}" for x in middles[bad][0])
            text = f"{source}: {bad.sum()} of {len(triangles)} boundary faces {fault} (first at ({first_at}) m); "
            if fault.startswith("are"):
                warnings.warn(f"{text}merge the nodes there if the parts hold together.", stacklevel=3)
            else:
                raise InputError(f"{text}merge the nodes, mesh the parts together, or give each a file of its own.")


def _coinciding(mesh: TetMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pairs (k,), (k,) of boundary faces that coincide and face each other, and place numbers (n,) of nodes."""
    triangles, surface, edges = mesh.triangles, mesh.surface, mesh.edges
    shortest = np.full(len(mesh.nodes), np.inf)
    np.minimum.at(shortest, edges, edge_lengths(mesh.nodes, edges)[:, None])
    reach_m = SAME * shortest[surface]
    pairs = cKDTree(mesh.nodes[surface]).query_pairs(reach_m.max(initial=0.0), output_type="ndarray")
    same_place = edge_lengths(mesh.nodes, surface[pairs]) <= reach_m[pairs].min(axis=1)
    group = components(surface[pairs[same_place]], len(mesh.nodes))
    _, kind, count = np.unique(np.sort(group[triangles], axis=1), axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(kind, kind="stable")
    one_face, other_face = order[count[kind[order]] == 2].reshape(-1, 2).T
    normals = area_normals(mesh.nodes, triangles)
    facing = np.einsum("ij,ij->i", normals[one_face], normals[other_face]) < 0
    return one_face[facing], other_face[facing], group
