"""Double the nodes of faces inside a mesh, so that the elements that they joined can come apart."""

from dataclasses import dataclass

import numpy as np

from palpate.bodies.mesh import FACES, TetMesh, components, ranked_faces


@dataclass(frozen=True, eq=False)
class Severed:
    """A mesh after its faces were severed.

    mesh : whose first nodes are those of the whole mesh, and the others their copies; elements keep their numbers
    origin : (n,) the node of the whole mesh that each node was
    lips : (k, 2, 3) nodes of each severed face on both sides, corner by corner; the first side is that of the element
        with the lower number, whose outward winding the corners have. At the front both are the same node
    """

    mesh: TetMesh
    origin: np.ndarray
    lips: np.ndarray

    @property
    def apart(self) -> np.ndarray:
        """Which lips come apart, (k,) bool: not a face whose three corners are all at the front."""
        return (self.lips[:, 0] != self.lips[:, 1]).any(axis=1)

    @property
    def front(self) -> np.ndarray:
        """Edges (m, 2) where the lips end inside the body: of one pair of them, with both ends not doubled."""
        sides = self.lips[self.apart][:, :, [[0, 1], [1, 2], [2, 0]]]
        single = (sides[:, 0] == sides[:, 1]).all(axis=2)
        edges = np.sort(sides[:, 0][single], axis=1)
        kinds, count = np.unique(edges, axis=0, return_counts=True)
        return kinds[count == 1]


def inner_faces(mesh: TetMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the faces between two elements: their nodes (k, 3), increasing, and the elements (k, 2), increasing."""
    faces = np.sort(mesh.tetrahedra[:, FACES].reshape(-1, 3), axis=1)
    order, equals_next = ranked_faces(faces, len(mesh.nodes))
    at = np.flatnonzero(equals_next)
    pairs = np.sort(np.stack([order[at], order[at + 1]], axis=1) // 4, axis=1)
    return faces[order[at]], pairs


def sever(mesh: TetMesh, nodes: np.ndarray, elements: np.ndarray, cut: np.ndarray) -> Severed:
    """Sever faces of ``mesh``: each group of elements at a node that faces still join gets a node of its own.

    nodes, elements : of ``inner_faces``; cut : (k,) bool, which of them are severed
    A node at the front of the cut stays one, as its elements are joined around it. Pieces that are cut free, cuts that
    cross and nodes where three pieces meet need no further rule.
    """
    # corner a of element e is 4 e + a; a face that is not severed joins its corners on both sides, node by node
    tetrahedra, count = mesh.tetrahedra, len(mesh.nodes)
    touched = np.zeros(count, dtype=bool)
    touched[nodes[cut]] = True
    faces, both_sides = nodes[~cut], elements[~cut]
    beside_cut = touched[faces].any(axis=1)
    faces, both_sides = faces[beside_cut], both_sides[beside_cut]
    local_corner = [np.argmax(tetrahedra[both_sides[:, s]][:, None, :] == faces[:, :, None], axis=2) for s in (0, 1)]
    pairs = np.stack([4 * both_sides[:, s, None] + local_corner[s] for s in (0, 1)], axis=-1).reshape(-1, 2)
    group = components(pairs, tetrahedra.size)
    # the group of the first element at a node keeps the node's number
    corners_at_cut = np.flatnonzero(touched[tetrahedra.ravel()])
    node_of_corner = tetrahedra.ravel()[corners_at_cut]
    corner_groups, first_corner, inverse = np.unique(
        node_of_corner * np.int64(tetrahedra.size) + group[corners_at_cut], return_index=True, return_inverse=True
    )
    node_of_group = corner_groups // tetrahedra.size
    order = np.lexsort((first_corner, node_of_group))
    sorted_node, keeps_number = node_of_group[order], np.ones(len(order), dtype=bool)
    keeps_number[1:] = sorted_node[1:] != sorted_node[:-1]
    new_number = np.empty(len(order), dtype=np.int64)
    new_number[order[keeps_number]] = sorted_node[keeps_number]
    new_number[order[~keeps_number]] = count + np.arange((~keeps_number).sum())
    renamed = tetrahedra.copy()
    renamed.flat[corners_at_cut] = new_number[inverse]
    origin = np.append(np.arange(count), sorted_node[~keeps_number])
    severed = TetMesh(mesh.nodes[origin], renamed)
    return Severed(severed, origin, _lips(tetrahedra, renamed, nodes[cut], elements[cut]))


def _lips(tetrahedra: np.ndarray, renamed: np.ndarray, faces: np.ndarray, elements: np.ndarray) -> np.ndarray:
    """Return the nodes (k, 2, 3) that severed ``faces`` (k, 3) have in the elements (k, 2) on their two sides."""
    if not len(faces):
        return np.empty((0, 2, 3), dtype=np.int64)
    opposite = np.argmax(~(tetrahedra[elements[:, 0]][:, :, None] == faces[:, None, :]).any(axis=2), axis=1)
    wound_faces = np.take_along_axis(tetrahedra[elements[:, 0]], FACES[opposite], axis=1)
    lips = []
    for side in (0, 1):
        corners = tetrahedra[elements[:, side]]
        local_corner = np.argmax(corners[:, None, :] == wound_faces[:, :, None], axis=2)
        lips.append(np.take_along_axis(renamed[elements[:, side]], local_corner, axis=1))
    return np.stack(lips, axis=1)
