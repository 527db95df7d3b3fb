"""Cut a level of a body as simulations do: by removing elements, along their faces, or with virtual nodes.

An element is crossed where a cut divides it and the middle of the section lies in the patch. So the front runs along
faces: an element that it lies in is whole, or crossed entirely. All three ways are one search for what is still joined,
``sever``'s, and differ in the elements that it is given: without the crossed ones, all whole, or with a copy of each
crossed one for each of its parts (Molino, Bao, Fedkiw 2004), which has as much tissue as its part has volume.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.cutting.cut import Cut
from palpate.bodies.cutting.sever import inner_faces, sever
from palpate.bodies.material import Tissue
from palpate.bodies.mesh import FACES, Around, TetMesh, components
from palpate.bodies.supports import can_hold
from palpate.errors import InputError

REMOVAL, SPLIT_FACES, VIRTUAL_NODES = "removal", "split_faces", "virtual_nodes"
WAYS = (REMOVAL, SPLIT_FACES, VIRTUAL_NODES)
LEAST_SHARE = 1e-3
"""Share of an element's volume below which a part of it goes to the other side, so that no stiffness is smaller."""
NEAR_PLANE = 1e-6
"""Distance over the size of the body within which a section of a plane is one of the cut."""

Joints = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Faces between copies: their nodes (k, 3), the copies (k, 2), and which are severed, (k,) bool."""


@dataclass(frozen=True, eq=False)
class Parted:
    """A level of a body after cuts.

    body : the cut level, without removed elements; its ``regions`` say how much of each element is tissue
    whole : the mesh before; node i was ``origin[i]``, (n,), of it, and element e a part of ``parents[e]``, (m,)
    sides : (m, cuts) on which side of each cut an element is: 1, -1, or 0 for both, beyond the front
    solid : (n,) bool, false for a node that has no tissue at its own place, the corner of a copy's empty part
    lost_share : of the volume, with removed elements
    """

    body: Body
    whole: TetMesh
    origin: np.ndarray
    parents: np.ndarray
    sides: np.ndarray
    solid: np.ndarray
    lost_share: float

    @property
    def mesh(self) -> TetMesh:
        mesh = self.body.coarse
        assert isinstance(mesh, TetMesh)
        return mesh

    def loose(self, held: np.ndarray) -> np.ndarray:
        """Return the nodes (n,) bool of pieces that can move or turn as a whole while nodes ``held`` (n,) are fixed."""
        piece, loose = components(self.mesh.edges, len(self.origin)), np.zeros(len(self.origin), dtype=bool)
        for number in range(piece.max() + 1):
            in_piece = piece == number
            if not can_hold(self.mesh.nodes[in_piece & held], self.mesh.size):
                loose |= in_piece & ~held
        return loose

    def interpolation(self, rows: sparse.csr_array, sides: np.ndarray) -> sparse.csr_array:
        """Return the interpolation (k, n) to points of the whole body from elements on their own side.

        rows : (k, n_whole), interpolation to the same points from the nodes of ``whole``, each row from one element
        sides : (k, cuts) of the points, 1 or -1. Where all elements of a point are lost, or on the other side, its
            displacement is extrapolated from the element of its own side, if there is any, whose middle is nearest
        """
        rows, whole_nodes = sparse.csr_array(rows), self.origin[self.mesh.tetrahedra]
        single = np.bincount(self.parents, minlength=len(self.whole.tetrahedra)) == 1
        changed = np.bincount(self.origin, minlength=len(self.whole.nodes)) != 1
        changed[self.whole.tetrahedra[~single]] = True
        new_number = np.zeros(len(changed), dtype=np.int64)
        new_number[self.origin] = np.arange(len(self.origin))
        of_entry = np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr))
        changed_rows = np.unique(of_entry[changed[rows.indices]])
        kept = ~np.isin(of_entry, changed_rows)
        entries = [(of_entry[kept], new_number[rows.indices[kept]], rows.data[kept])]
        around = Around(whole_nodes, len(changed))
        for row in changed_rows:
            entries_of_row = slice(rows.indptr[row], rows.indptr[row + 1])
            corners, weights = rows.indices[entries_of_row], rows.data[entries_of_row]
            elements = around.of(corners[0])
            for corner in corners[1:]:
                elements = np.intersect1d(elements, around.of(corner))
            elements = elements[(self.sides[elements] * sides[row] >= 0).all(axis=1)]
            if len(elements):
                places = np.argmax(whole_nodes[elements[0]] == corners[:, None], axis=1)
                nodes = self.mesh.tetrahedra[elements[0], places]
            else:
                allowed = np.flatnonzero((self.sides * sides[row] >= 0).all(axis=1))
                allowed = allowed if len(allowed) else np.arange(len(whole_nodes))
                place = weights @ self.whole.nodes[corners]
                middles = self.mesh.nodes[self.mesh.tetrahedra[allowed]].mean(axis=1)
                nearest = allowed[np.linalg.norm(middles - place, axis=1).argmin()]
                nodes = self.mesh.tetrahedra[nearest]
                weights = np.linalg.solve(np.vstack([self.mesh.nodes[nodes].T, np.ones(4)]), np.append(place, 1.0))
            entries.append((np.full(len(nodes), row), nodes, weights))
        places, columns, data = (np.concatenate(each) for each in zip(*entries, strict=True))
        return sparse.csr_array((data, (places, columns)), shape=(rows.shape[0], len(self.origin)))


def whole(body: Body, level: int, cuts: int) -> Parted:
    """Return an uncut ``level`` of a body in the form that ``part`` returns, with sides 0 of each of ``cuts`` cuts."""
    mesh = body.levels[level]
    assert isinstance(mesh, TetMesh)
    of_level = body.from_level(level).up_to(0)
    origins = np.arange(len(mesh.nodes)), np.arange(len(mesh.tetrahedra))
    sides = np.zeros((len(mesh.tetrahedra), cuts), dtype=np.int64)
    return Parted(of_level, mesh, *origins, sides, np.ones(len(mesh.nodes), dtype=bool), 0.0)


def part(body: Body, level: int, cuts: Sequence[Cut], way: str) -> Parted:
    """Cut a ``level`` of a body at rest in one of WAYS; cuts may cross.

    Raises InputError for a body on a bed, whose springs would hold lips as well, and where nothing is left.
    """
    if body.bed is not None:
        raise InputError(f"{body.name}: a body on a bed is not cut; give it anchors.")
    mesh, tissue = body.levels[level], body.tissue(level)
    assert isinstance(mesh, TetMesh)
    copies = _centred(mesh, cuts) if way == SPLIT_FACES else _copied(mesh, cuts)
    joints = _joints(mesh, cuts, copies, strict=way != SPLIT_FACES)
    if way == REMOVAL:
        copies, joints = _without_crossed(copies, joints)
        if not len(copies.parents):
            raise InputError(f"{body.name}: a cut crosses every element of level {level}; take a finer one.")
    parents, sides, doubled, shares = copies
    severed = sever(TetMesh(mesh.nodes, mesh.tetrahedra[parents]), *joints)
    used, tetrahedra = np.unique(severed.mesh.tetrahedra, return_inverse=True)
    tetrahedra, origin = tetrahedra.reshape(-1, 4), severed.origin[used]
    # where faces are split, a whole element may lie on the other side than one of its corners
    one_sided = sides != 0 if way == SPLIT_FACES else doubled
    empty = np.zeros(tetrahedra.shape, dtype=bool)  # corners on the other side than the tissue of their copy
    for c, cut in enumerate(cuts):
        across = cut.across(mesh.nodes)[origin]
        # a node on the cut is on both sides
        side_of_node = np.where(np.abs(across) <= NEAR_PLANE * mesh.size, 0, np.sign(across))
        empty |= one_sided[:, c, None] & (sides[:, c, None] * side_of_node[tetrahedra] < 0)
    solid = np.zeros(len(origin), dtype=bool)
    solid[tetrahedra[~empty]] = True
    # a node none of whose copies has tissue there: all of them count as having it
    solid |= ~np.isin(origin, origin[solid])
    anchors = np.flatnonzero(np.isin(origin, body.anchors[level]) & solid)
    regions = Tissue(tissue.materials, tissue.region[parents], shares)
    densities = None if body.densities is None else [body.densities[level][origin]]
    parted = replace(
        body.up_to(0), levels=[TetMesh(mesh.nodes[origin], tetrahedra)], anchors=[anchors], regions=regions,
        densities=densities, smooth=None,
    )  # fmt: skip
    lost = 1.0 - float(mesh.volumes[parents] @ shares) / float(mesh.volumes.sum())
    return Parted(parted, mesh, origin, parents, sides, solid, lost)


class _Copies(NamedTuple):
    """Elements, some of them several times.

    parents : (n,) of the mesh; sides : (n, cuts); doubled : (n, cuts) bool; shares : (n,) of tissue in each
    """

    parents: np.ndarray
    sides: np.ndarray
    doubled: np.ndarray
    shares: np.ndarray


def _centred(mesh: TetMesh, cuts: Sequence[Cut]) -> _Copies:
    """Return each element as one copy, on the side of each cut on which its middle is."""
    count, sides = len(mesh.tetrahedra), sides_of(cuts, mesh.nodes[mesh.tetrahedra].mean(axis=1))
    return _Copies(np.arange(count), sides, np.zeros(sides.shape, dtype=bool), np.ones(count))


def _copied(mesh: TetMesh, cuts: Sequence[Cut]) -> _Copies:
    """Return a copy of each element for each of its parts; parts below LEAST_SHARE of the volume are left out."""
    sides_of_elements, doubled, piece_element, piece_sides, piece_volumes = _crossed(mesh, cuts)
    whole = np.flatnonzero(~doubled.any(axis=1))
    cut_through = doubled[piece_element]
    is_divided = cut_through.any(axis=1)
    sides = np.where(cut_through, piece_sides, sides_of_elements[piece_element])[is_divided]
    rows, row = np.unique(np.column_stack([piece_element[is_divided], sides]), axis=0, return_inverse=True)
    volumes = np.bincount(row.ravel(), piece_volumes[is_divided], minlength=len(rows))
    parents, sides = rows[:, 0], rows[:, 1:]
    large_enough = volumes >= LEAST_SHARE * mesh.volumes[parents]
    parents, sides, volumes = parents[large_enough], sides[large_enough], volumes[large_enough]
    tissue_volume = np.bincount(parents, volumes, minlength=len(mesh.tetrahedra))
    return _Copies(
        np.append(whole, parents),
        np.vstack([sides_of_elements[whole], sides]),
        np.vstack([np.zeros((len(whole), sides.shape[1]), dtype=bool), doubled[parents]]),
        np.append(np.ones(len(whole)), volumes / tissue_volume[parents]),
    )


def _without_crossed(copies: _Copies, joints: Joints) -> tuple[_Copies, Joints]:
    """Remove crossed elements, and sever the faces that they bare, so that nothing hangs by a node or an edge."""
    kept = np.logical_not(copies.doubled.any(axis=1))
    (faces, pairs, blocked), number = joints, np.cumsum(kept) - 1
    both_kept, one_kept = kept[pairs].all(axis=1), kept[pairs].sum(axis=1) == 1
    kept_side = np.where(kept[pairs[one_kept, 0]], pairs[one_kept, 0], pairs[one_kept, 1])
    pairs = number[np.vstack([pairs[both_kept], np.column_stack([kept_side, kept_side])])]
    blocked = np.append(blocked[both_kept], np.ones(len(kept_side), dtype=bool))
    return _Copies(*(each[kept] for each in copies)), (np.vstack([faces[both_kept], faces[one_kept]]), pairs, blocked)


def _joints(mesh: TetMesh, cuts: Sequence[Cut], copies: _Copies, strict: bool) -> Joints:
    """Find the faces between copies, and which of them are severed.

    Between copies on different sides of a cut a face is severed where one of them is a part of a crossed element, and
    otherwise where the face is in the patch. Parts of one element have its four faces between them, severed.
    strict : whether a face is in the patch if its middle is, and not if the line between its elements' middles crosses
    """
    copies_of = Around(copies.parents[:, None], len(mesh.tetrahedra))
    order, starts = copies_of.elements, copies_of.ends
    faces, elements = inner_faces(mesh)
    copied = np.flatnonzero(np.diff(starts) > 1)
    faces_within = np.sort(mesh.tetrahedra[copied][:, FACES].reshape(-1, 3), axis=1)
    faces = np.vstack([faces, faces_within])
    elements = np.vstack([elements, np.repeat(copied, 4)[:, None] * [1, 1]])
    # a face of elements with p and q copies is between p q pairs of copies
    p, q = np.diff(starts)[elements].T
    face = np.repeat(np.arange(len(faces)), p * q)
    nth_pair = np.arange(len(face)) - np.repeat(np.cumsum(p * q) - p * q, p * q)
    pairs = np.column_stack(
        [
            order[starts[elements[face, 0]] + nth_pair // q[face]],
            order[starts[elements[face, 1]] + nth_pair % q[face]],
        ]
    )
    distinct = pairs[:, 0] != pairs[:, 1]
    face, pairs = face[distinct], pairs[distinct]
    blocked = np.zeros(len(face), dtype=bool)
    for c, cut in enumerate(cuts):
        between_sides = np.flatnonzero(copies.sides[pairs, c].prod(axis=1) < 0)
        of_crossed = copies.doubled[pairs[between_sides], c].any(axis=1)
        if strict:
            inside = cut.within(mesh.nodes[faces[face[between_sides]]].mean(axis=1)) > 0.0
        else:
            ends = mesh.nodes[mesh.tetrahedra[copies.parents[pairs[between_sides]]]].mean(axis=2)
            inside = cut.severs(ends[:, 0], ends[:, 1])
        blocked[between_sides[of_crossed | inside]] = True
    return faces[face], pairs, blocked


def _crossed(mesh: TetMesh, cuts: Sequence[Cut]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Divide the m elements into k pieces along the planes of all flat pieces of the cuts.

    Returns the sides (m, cuts) of the elements, 0 where a cut divides one; whether its patch does, (m, cuts) bool; and
    of the pieces the elements (k,), the sides (k, cuts) and the volumes (k,) [m³].
    """
    corners, count = mesh.nodes[mesh.tetrahedra], len(mesh.tetrahedra)
    sides = sides_of(cuts, corners.mean(axis=1))
    mixed = (np.ptp(sides_of(cuts, mesh.nodes)[mesh.tetrahedra], axis=1) > 0).any(axis=1)
    owner_element = np.flatnonzero(mixed)
    pieces, areas, areas_inside = corners[owner_element], np.zeros((count, len(cuts))), np.zeros((count, len(cuts)))
    for number, cut in enumerate(cuts):
        for flat in cut.pieces:
            pieces, owner_element, sections, owner = divide(pieces, owner_element, flat.across(pieces.reshape(-1, 3)))
            diagonals = sections[:, 2] - sections[:, 0], sections[:, 3] - sections[:, 1]
            middles, section_area = sections.mean(axis=1), 0.5 * np.linalg.norm(np.cross(*diagonals), axis=1)
            on_cut = np.abs(cut.across(middles)) <= NEAR_PLANE * mesh.size
            areas[:, number] += np.bincount(owner[on_cut], section_area[on_cut], minlength=count)
            on_cut &= cut.within(middles) > 0.0
            areas_inside[:, number] += np.bincount(owner[on_cut], section_area[on_cut], minlength=count)
    piece_sides = sides_of(cuts, pieces.mean(axis=1))
    piece_volumes = np.abs(TetMesh(pieces.reshape(-1, 3), np.arange(4 * len(pieces)).reshape(-1, 4)).volumes)
    doubled = np.zeros(sides.shape, dtype=bool)
    for number in range(len(cuts)):
        share = np.bincount(owner_element, piece_volumes * (piece_sides[:, number] > 0), minlength=count) / mesh.volumes
        share[~mixed] = sides[~mixed, number] > 0
        divided = (share >= LEAST_SHARE) & (share <= 1.0 - LEAST_SHARE)
        sides[:, number] = np.where(divided, 0, np.where(share > 0.5, 1, -1))
        doubled[:, number] = divided & (areas_inside[:, number] > 0.5 * areas[:, number])
    return sides, doubled, owner_element, piece_sides, piece_volumes


def divide(
    parts: np.ndarray, owner: np.ndarray, value: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Divide tetrahedra or triangles where a linear function changes its sign, into tetrahedra or triangles.

    parts : (k, 4 or 3, n), n linear quantities at the corners, such as coordinates; owner : (k,) number of each part
    value : (4k or 3k,) of the function at the corners
    Returns the new parts and their owners, the sections (s, 4 or 2, n) between them, which have the last corner twice
    if they are triangles, and the owners of these.
    """
    value = value.reshape(parts.shape[:2])
    order = np.argsort(-value, axis=1, kind="stable")
    parts, value = np.take_along_axis(parts, order[:, :, None], axis=1), np.take_along_axis(value, order, axis=1)
    above = (value >= 0.0).sum(axis=1)
    undivided = (above == 0) | (above == value.shape[1])
    divided, owners, sections, section_owners = [parts[undivided]], [owner[undivided]], [], []
    for number, (edges, pieces, section) in DIVISIONS[value.shape[1]].items():
        chosen = above == number
        corners, values = parts[chosen], value[chosen]
        on_edges = [
            corners[:, i] + (values[:, i] / (values[:, i] - values[:, j]))[:, None] * (corners[:, j] - corners[:, i])
            for i, j in edges
        ]
        points = np.stack([*np.swapaxes(corners, 0, 1), *on_edges], axis=1)
        for piece in pieces:
            divided.append(points[:, piece])
            owners.append(owner[chosen])
        sections.append(points[:, section])
        section_owners.append(owner[chosen])
    return np.concatenate(divided), np.concatenate(owners), np.concatenate(sections), np.concatenate(section_owners)


def _prism(a: int, b: int, c: int, d: int, e: int, f: int) -> list[list[int]]:
    """Return the three tetrahedra of a prism between the triangles a b c and d e f."""
    return [[a, b, c, d], [b, c, d, e], [c, d, e, f]]


DIVISIONS: dict[int, dict] = {
    4: {
        1: ([(0, 1), (0, 2), (0, 3)], [[0, 4, 5, 6], *_prism(1, 2, 3, 4, 5, 6)], [4, 5, 6, 6]),
        2: ([(0, 2), (0, 3), (1, 2), (1, 3)], [*_prism(0, 4, 5, 1, 6, 7), *_prism(2, 4, 6, 3, 5, 7)], [4, 5, 7, 6]),
        3: ([(0, 3), (1, 3), (2, 3)], [[3, 4, 5, 6], *_prism(0, 1, 2, 4, 5, 6)], [4, 5, 6, 6]),
    },
    3: {
        1: ([(0, 1), (0, 2)], [[0, 3, 4], [3, 1, 2], [3, 2, 4]], [3, 4]),
        2: ([(0, 2), (1, 2)], [[2, 3, 4], [3, 0, 1], [3, 1, 4]], [3, 4]),
    },
}
"""Of a simplex by its corners, and how many of them, ordered by value, lie above 0: the edges that are divided, on
which further corners lie; its parts, by corners; and the section."""


def sides_of(cuts: Sequence[Cut], points: np.ndarray) -> np.ndarray:
    """Return the side of each cut, 1 or -1, on which ``points`` (n, 3) [m] are, (n, cuts)."""
    return np.column_stack([np.where(cut.across(points) >= 0.0, 1, -1) for cut in cuts])
