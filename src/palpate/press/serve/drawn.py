"""The surface of a cut body to be drawn: its skin, divided where the blade went, and the two lips.

With virtual nodes both copies of a crossed element have its whole skin, also where they have no tissue. So the skin
on doubled elements is divided by the surfaces of the cuts, each part follows the copy on its side, and the sections
of these elements are drawn twice, as the lips. A lip ends where the model's crack does, at faces.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from palpate.bodies.cutting.cut import Cut
from palpate.bodies.cutting.ways import NEAR_PLANE, Parted, divide, sides_of
from palpate.bodies.mesh import FACES, Around, TetMesh, area_normals, corner_normals, triangle_edges

SAME = 1e-8
"""Distance over the size of the body within which two points are one."""
FLAT = 1e-9
"""Area of a part over that of its triangle below which it is none."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """A surface at rest that follows the nodes of a parted level.

    nodes : (n, 3) [m], those of the skin first; triangles : (t, 3), wound outward, likewise
    skin_nodes : how many of them are of the skin; the others are of lips
    rows : (n, n_parted) the interpolation to them
    rims : (k, 2) nodes of the edges of the skin that run along cuts
    """

    nodes: np.ndarray
    triangles: np.ndarray
    skin_nodes: int
    rows: sparse.csr_array
    rims: np.ndarray


def drawn(
    parted: Parted, cuts: Sequence[Cut], nodes: np.ndarray, triangles: np.ndarray, rows: sparse.csr_array
) -> Drawn:
    """Return the surface of a level that virtual nodes part along ``cuts``.

    nodes, triangles : (n, 3) [m], (t, 3) of the skin of the whole body; rows : (n, n_whole) from the level's nodes
    """
    if not cuts:
        return Drawn(nodes, triangles, len(nodes), rows, np.empty((0, 2), dtype=np.int64))
    size = float(np.ptp(nodes, axis=0).max())
    skin = _welded(*_skin(parted, cuts, nodes, triangles, rows), size)
    lips = _welded(*_lips(parted, cuts, size), size)
    count = len(skin[0])
    return Drawn(
        np.vstack([skin[0], lips[0]]),
        np.vstack([skin[1], lips[1] + count]),
        count,
        sparse.csr_array(sparse.vstack([skin[2], lips[2]])),
        _rims(cuts, skin[0], skin[1], NEAR_PLANE * size),
    )


def _rims(cuts: Sequence[Cut], nodes: np.ndarray, triangles: np.ndarray, near: float) -> np.ndarray:
    """Return the border edges (k, 2) of the skin both of whose ends are on the surface of one cut."""
    edges, count = triangle_edges(triangles)
    on_cut = np.any([(np.abs(cut.across(nodes)) <= near)[edges].all(axis=1) for cut in cuts], axis=0)
    return edges[on_cut & (count == 1)]


def _welded(points: np.ndarray, rows: sparse.csr_array, size: float) -> tuple[np.ndarray, np.ndarray, sparse.csr_array]:
    """Join the corners (t, 3, 3) [m] of triangles that are at one place and have the same interpolation.

    rows : (3t, n) interpolation to the corners
    Returns points, triangles and rows; triangles two of whose corners are one are left out.
    """
    corners = points.reshape(-1, 3)
    # rows differ if their products with random numbers do
    product = rows @ np.random.default_rng(0).random(rows.shape[1])
    keys = np.column_stack([np.round(corners / (SAME * size)), np.round(product / SAME)])
    _, first_of_point, point = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    triangles = point.reshape(-1, 3)
    distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return corners[first_of_point], triangles[distinct], rows[first_of_point]


def _skin(
    parted: Parted, cuts: Sequence[Cut], nodes: np.ndarray, triangles: np.ndarray, rows: sparse.csr_array
) -> tuple[np.ndarray, sparse.csr_array]:
    """Return the corners (t, 3, 3) [m] of the skin, divided on doubled elements, and their interpolation (3t, n)."""
    element = _under(parted.whole, triangles, rows)
    doubled = np.bincount(parted.parents, minlength=len(parted.whole.tetrahedra))[element] > 1
    owner, weights = np.flatnonzero(doubled), np.broadcast_to(np.eye(3), (doubled.sum(), 3, 3))
    for cut in cuts:
        for piece in cut.pieces:
            values = piece.across((weights @ nodes[triangles[owner]]).reshape(-1, 3))
            weights, owner, *_ = divide(weights, owner, values)
    whole = np.flatnonzero(~doubled)
    owner, weights = np.append(whole, owner), np.concatenate([np.broadcast_to(np.eye(3), (len(whole), 3, 3)), weights])
    corners = weights @ nodes[triangles[owner]]
    normals = area_normals(nodes, triangles)[owner]
    area_share = (corner_normals(corners) * normals).sum(axis=1) / (normals**2).sum(axis=1)
    for each in (weights, corners):
        each[area_share < 0.0] = each[area_share < 0.0][:, ::-1]
    kept = np.abs(area_share) > FLAT
    owner, weights, corners = owner[kept], weights[kept], corners[kept]
    copies = _copies(parted, element[owner], sides_of(cuts, corners.mean(axis=1)))
    # each corner is interpolated from the skin's nodes, these from nodes of the level, and so from those of the copy
    count = 3 * len(owner)
    entries = weights.ravel(), (np.repeat(np.arange(count), 3), np.repeat(triangles[owner], 3, axis=0).ravel())
    mixed = (sparse.csr_array(entries, shape=(count, len(nodes))) @ rows).tocoo()
    mixed.eliminate_zeros()
    nodes_of_element = parted.whole.tetrahedra[element[owner]][mixed.row // 3]
    copy_nodes = parted.mesh.tetrahedra[copies[mixed.row // 3], (nodes_of_element == mixed.col[:, None]).argmax(axis=1)]
    return corners, sparse.csr_array((mixed.data, (mixed.row, copy_nodes)), shape=(count, len(parted.origin)))


def _under(mesh: TetMesh, triangles: np.ndarray, rows: sparse.csr_array) -> np.ndarray:
    """Return the element (t,) of ``mesh`` under each of ``triangles`` (t, 3), which ``rows`` interpolate from it."""
    pattern = sparse.csr_array((np.ones(rows.nnz), rows.indices, rows.indptr), shape=rows.shape)
    entries = np.repeat(np.arange(len(triangles)), 3), triangles.ravel()
    corners = sparse.csr_array((np.ones(triangles.size), entries), shape=(len(triangles), rows.shape[0])) @ pattern
    corners.sort_indices()
    faces, count = np.sort(mesh.tetrahedra[:, FACES].reshape(-1, 3), axis=1), len(mesh.nodes)
    level_faces = corners.indices.reshape(-1, 3).astype(np.int64)
    keys, wanted_keys = ((each[:, 0] * count + each[:, 1]) * count + each[:, 2] for each in (faces, level_faces))
    order = np.argsort(keys)
    return order[np.searchsorted(keys[order], wanted_keys)] // 4


def _lips(parted: Parted, cuts: Sequence[Cut], size: float) -> tuple[np.ndarray, sparse.csr_array]:
    """Return corners (t, 3, 3) [m] of both lips' triangles, sections of doubled elements, and a map (3t, n) to them."""
    mesh, corners = parted.whole, [np.empty((0, 3, 3))]
    nodes, weights = [np.empty((0, 3, 4), int)], [np.empty((0, 3, 4))]
    doubled = np.flatnonzero(np.bincount(parted.parents) > 1)
    all_pieces = [piece for cut in cuts for piece in cut.pieces]
    for c, cut in enumerate(cuts):
        for piece in cut.pieces:
            pieces, element = mesh.nodes[mesh.tetrahedra[doubled]], doubled
            for other in all_pieces:  # so that no section is on both sides of another piece
                if other is not piece:
                    pieces, element, *_ = divide(pieces, element, other.across(pieces.reshape(-1, 3)))
            _, _, sections, element = divide(pieces, element, piece.across(pieces.reshape(-1, 3)))
            on_cut = np.abs(cut.across(sections.mean(axis=1))) <= NEAR_PLANE * size
            sections, element = sections[on_cut], element[on_cut]
            sides = sides_of(cuts, sections.mean(axis=1))
            copies_by_side = []
            for side in (1, -1):
                sides[:, c] = side
                copies_by_side.append(_copies(parted, element, sides))
            apart = copies_by_side[0] != copies_by_side[1]
            # barycentric coordinates (k, 4, 4) of the corners of sections in their elements
            frames, places = (
                np.concatenate([np.swapaxes(points, 1, 2), np.ones((len(element), 1, 4))], axis=1)
                for points in (mesh.nodes[mesh.tetrahedra[element]], sections)
            )
            barycentric = np.swapaxes(np.linalg.solve(frames, places), 1, 2)
            for triangle in ([0, 1, 2], [0, 2, 3]):  # of a section with four corners
                section, weight = sections[:, triangle], barycentric[:, triangle]
                facing = corner_normals(section) @ piece.normal
                # each lip's triangles are wound so that they face the gap
                for copies, outward in zip(copies_by_side, (-1.0, 1.0), strict=True):
                    for kept, step in ((apart & (outward * facing > 0.0), 1), (apart & (outward * facing < 0.0), -1)):
                        corners.append(section[kept, ::step])
                        weights.append(weight[kept, ::step])
                        nodes.append(np.repeat(parted.mesh.tetrahedra[copies[kept]][:, None], 3, axis=1))
    points, node_rows = np.concatenate(corners), np.concatenate(nodes).reshape(-1, 4)
    entries = np.concatenate(weights).ravel(), (np.repeat(np.arange(len(node_rows)), 4), node_rows.ravel())
    return points, sparse.csr_array(entries, shape=(len(node_rows), len(parted.origin)))


def _copies(parted: Parted, element: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Return the first copy of each ``element`` (k,) that is on ``sides`` (k, cuts), or if none is, its first one."""
    copies_of = Around(parted.parents[:, None], len(parted.whole.tetrahedra))
    order, starts = copies_of.elements, copies_of.ends
    chosen = order[starts[element]]
    counts = np.diff(starts)[element]
    for number in range(int(counts.max(initial=0)) - 1, -1, -1):
        rows = np.flatnonzero(number < counts)
        copies = order[starts[element[rows]] + number]
        on_side = (parted.sides[copies] * sides[rows] >= 0).all(axis=1)
        chosen[rows[on_side]] = copies[on_side]
    return chosen
