"""Paper 2's cube: 120 nodes, 377 tetrahedra, 590 edges."""

import numpy as np
from scipy.spatial import Delaunay

from palpate.bodies.mesh import EDGES, TetMesh
from palpate.bodies.mesh_quality import dihedral_angles

TETRAHEDRA = 377
FACES = {"top": (2, 1), "left": (0, 0), "front": (1, 0)}
"""Pressed faces: axis of the normal, and whether it is at the upper end; x to the right, y backward, z up."""
SEED, JITTER = 87, 0.3


def paper_cube(side_m: float) -> TetMesh:
    """Build the cube [0, side_m]³ with the paper's counts, and a node in the middle of each face.

    The paper does not give the positions of its nodes. By Euler's formula its counts leave 96 nodes on the surface and
    24 inside, five less than a lattice of four cells per edge. So: that lattice without five nodes and with random
    displacements, its Delaunay tetrahedra, which are about 400, and then edge removals (3-2 flips), the one that most
    improves the worst angle first, until 377 are left. ``SEED`` is the one of the first 330 whose smallest angle is
    largest, 12.8°.
    """
    points = _points(SEED)
    tetrahedra = _orient(points, Delaunay(points).simplices.astype(np.int64))
    while len(tetrahedra) > TETRAHEDRA:
        tetrahedra = _remove_edge(points, tetrahedra)
    return TetMesh(side_m * points, tetrahedra)


def middle(mesh: TetMesh, face: str) -> tuple[int, np.ndarray]:
    """Find the node nearest to the middle of a face of a cube, one of ``FACES``, and its inward normal (3,)."""
    axis, upper = FACES[face]
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    point, inward = 0.5 * (low + high), np.zeros(3)
    point[axis] = high[axis] if upper else low[axis]
    inward[axis] = -1.0 if upper else 1.0
    return int(np.argmin(np.linalg.norm(mesh.nodes - point, axis=1))), inward


def _points(seed: int) -> np.ndarray:
    """Place nodes in the unit cube: those of a face stay in it, those of edges and middles of faces do not move."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(5) / 4.0] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    outer = (grid == 0.0) | (grid == 1.0)
    faces = (outer.sum(axis=1) == 1) & ((grid == 0.5).sum(axis=1) < 2)
    inside = ~outer.any(axis=1)
    # not on the three pressed faces
    dropped = [rng.choice(np.flatnonzero(faces & (grid[:, axis] == end))) for axis, end in ((2, 0.0), (1, 1.0))]
    dropped += rng.choice(np.flatnonzero(inside), 3, replace=False).tolist()
    move = np.where(outer | ~(faces | inside)[:, None], 0.0, rng.uniform(-JITTER, JITTER, grid.shape) / 4.0)
    return np.delete(grid + move, dropped, axis=0)


def _orient(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Orient tetrahedra positively and drop the flat ones that Delaunay's triangulation has on a face."""
    volumes = TetMesh(points, tetrahedra).volumes
    tetrahedra[volumes < 0.0] = tetrahedra[volumes < 0.0][:, [0, 2, 1, 3]]
    return tetrahedra[np.abs(volumes) > 1e-9]


def _remove_edge(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Replace the three tetrahedra around the worst edge by two."""
    worst = dihedral_angles(TetMesh(points, tetrahedra)).min(axis=1)
    ends = np.sort(tetrahedra[:, EDGES].reshape(-1, 2), axis=1)
    edges, number, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    best, chosen = -np.inf, (np.empty(0, dtype=np.int64), np.empty((0, 4), dtype=np.int64))
    for edge in np.flatnonzero(count == 3):
        old = np.flatnonzero(number.ravel() == edge) // len(EDGES)
        ring = np.setdiff1d(tetrahedra[old], edges[edge])
        if len(ring) > 3:  # on the surface
            continue
        new = np.array([[*ring, edges[edge][0]], [*ring[::-1], edges[edge][1]]])
        volumes = TetMesh(points, new).volumes
        if volumes[0] < 0.0:
            new, volumes = new[:, [1, 0, 2, 3]], -volumes
        if volumes.min() <= 0.0:
            continue
        gain = dihedral_angles(TetMesh(points, new)).min() - worst[old].min()
        if gain > best:
            best, chosen = gain, (old, new)
    old, new = chosen
    return np.concatenate([np.delete(tetrahedra, old, axis=0), new])
