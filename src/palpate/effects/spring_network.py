"""The springs of a body: edges of its tetrahedra, or structural, shear and bending springs of a surface."""

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import EDGES
from palpate.bodies.particles import Particles


def volume_springs(particles: Particles) -> tuple[np.ndarray, np.ndarray]:
    """Find the edges of the tetrahedra, (n_springs, 2), each once, and their stiffness (n_springs,) [N/m].

    k = E ΣV/l² with the volumes V of the tetrahedra around the edge (paper 2, eq. 5, with one E; Van Gelder 1998).
    Averaged over directions this gives the modulus E and a Poisson ratio of 1/4. Trap: no choice of k gives another
    ratio (Kot and Nagahashi), and on a regular mesh the stiffness depends on the direction.
    Raises InputError for tetrahedra of several stiffnesses.
    """
    particles.refuse_regions("springs have")
    pairs, around = sum_around_edges(particles, np.ones(len(particles.tetrahedra)))
    return pairs, particles.material.young_pa * around / rest_lengths(particles.nodes, pairs) ** 2


def sum_around_edges(particles: Particles, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the edges of tetrahedra, (n_edges, 2), and sum the volumes [m³] around each times ``weights`` (m,)."""
    ends = np.sort(particles.tetrahedra[:, EDGES].reshape(-1, 2), axis=1)
    pairs, edge = np.unique(ends, axis=0, return_inverse=True)
    a, b, c, d = (particles.nodes[particles.tetrahedra[:, i]] for i in range(4))
    volumes = weights * np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0
    return pairs, np.bincount(edge.ravel(), np.repeat(volumes, len(EDGES)), minlength=len(pairs))


def surface_springs(triangles: np.ndarray, n_nodes: int) -> dict[str, np.ndarray]:
    """Find pairs of nodes (n, 2) by kind, no pair twice, for a surface of ``triangles`` (t, 3).

    structural : edges of triangles; shear : opposite corners of two triangles that share an edge; bending : all other
    nodes two edges apart, on a regular grid of triangles the second neighbours along a line, as in models of cloth
    """
    halves = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1) @ [n_nodes, 1]
    opposite = triangles[:, [2, 0, 1]].ravel()
    order = np.argsort(halves, kind="stable")
    shared = np.flatnonzero(np.diff(halves[order]) == 0)
    across = np.sort(np.column_stack([opposite[order[shared]], opposite[order[shared + 1]]]), axis=1)
    structural = np.unique(halves)
    shear = np.setdiff1d(across[across[:, 0] != across[:, 1]] @ [n_nodes, 1], structural)
    i, j = np.divmod(structural, n_nodes)
    linked = sparse.coo_array((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), shape=(n_nodes, n_nodes)).tocsr()
    two = sparse.triu(linked @ linked, k=1).tocoo()
    bending = np.setdiff1d(two.row.astype(np.int64) * n_nodes + two.col, np.union1d(structural, shear))
    keys = {"structural": structural, "shear": shear, "bending": bending}
    return {kind: np.column_stack(np.divmod(key, n_nodes)) for kind, key in keys.items()}


def edge_stiffness(particles: Particles) -> float:
    """Compute Young's modulus times the mean length of an edge [N/m]: the stiffness of a cube of that size.

    Raises InputError for tetrahedra of several stiffnesses.
    """
    particles.refuse_regions("a stiffness that follows from Young's modulus needs")
    ends = particles.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    lengths = np.linalg.norm(particles.nodes[ends[:, 0]] - particles.nodes[ends[:, 1]], axis=1)
    return particles.material.young_pa * float(lengths.mean())


def rest_lengths(nodes: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Compute the distance between the nodes of each pair, (n_pairs,) [m]."""
    return np.linalg.norm(nodes[pairs[:, 1]] - nodes[pairs[:, 0]], axis=1)
