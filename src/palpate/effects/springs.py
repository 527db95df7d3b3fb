"""Linear springs between nodes, the elasticity of mass-spring models: edges of tetrahedra, or springs of a surface."""

from collections.abc import Sequence

import numba
import numpy as np
from scipy import sparse

from palpate.bodies.mesh import EDGES, TetMesh
from palpate.bodies.particles import Particles
from palpate.effects import settings
from palpate.effects.effect import Effect, Energy, Stiffness


def volume_springs(particles: Particles) -> tuple[np.ndarray, np.ndarray]:
    """Find the edges of the tetrahedra, (n_springs, 2), each once, and their stiffness (n_springs,) [N/m].

    k = E ΣV/l² with the volumes V of the tetrahedra around the edge (paper 2, eq. 5, with one E; Van Gelder 1998).
    Averaged over directions this gives the modulus E and a Poisson ratio of 1/4. Trap: no choice of k gives another
    ratio (Kot and Nagahashi), and on a regular mesh the stiffness depends on the direction.
    Raises InputError for tetrahedra of several stiffnesses.
    """
    particles.refuse_regions("springs have")
    volumes = TetMesh(particles.nodes, particles.tetrahedra).volumes
    pairs, around = sum_around_edges(particles.tetrahedra, volumes)
    return pairs, particles.material.young_pa * around / rest_lengths(particles.nodes, pairs) ** 2


def sum_around_edges(
    elements: np.ndarray, amounts: np.ndarray, edges: Sequence[tuple[int, int]] | np.ndarray = EDGES
) -> tuple[np.ndarray, np.ndarray]:
    """Find the edges (n_edges, 2) of ``elements``, and sum the ``amounts`` (m,) of those around each edge.

    elements : nodes (m, 4) of tetrahedra or (m, 3) of triangles; edges : pairs of corners, those of a tetrahedron
    """
    ends = np.sort(elements[:, edges].reshape(-1, 2), axis=1)
    pairs, edge = np.unique(ends, axis=0, return_inverse=True)
    return pairs, np.bincount(edge.ravel(), np.repeat(amounts, len(edges)), minlength=len(pairs))


def surface_springs(triangles: np.ndarray, n_nodes: int) -> dict[str, np.ndarray]:
    """Find pairs of nodes i, j (n, 2) by kind, each once, on ``triangles`` (t, 3); the code of a pair is i n_nodes + j.

    structural : edges of triangles; shear : opposite corners of two triangles that share an edge; bending : all other
    nodes two edges apart, on a regular grid of triangles the second neighbours along a line, as in models of cloth
    """
    half_edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1) @ [n_nodes, 1]
    opposite = triangles[:, [2, 0, 1]].ravel()
    order = np.argsort(half_edges, kind="stable")
    doubled = np.flatnonzero(np.diff(half_edges[order]) == 0)  # edges of two triangles
    opposites = np.sort(np.column_stack([opposite[order[doubled]], opposite[order[doubled + 1]]]), axis=1)
    structural = np.unique(half_edges)
    shear = np.setdiff1d(opposites[opposites[:, 0] != opposites[:, 1]] @ [n_nodes, 1], structural)
    i, j = np.divmod(structural, n_nodes)
    linked = sparse.coo_array((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), shape=(n_nodes, n_nodes)).tocsr()
    two_apart = sparse.triu(linked @ linked, k=1).tocoo()
    bending = np.setdiff1d(two_apart.row.astype(np.int64) * n_nodes + two_apart.col, np.union1d(structural, shear))
    keys = {"structural": structural, "shear": shear, "bending": bending}
    return {kind: np.column_stack(np.divmod(key, n_nodes)) for kind, key in keys.items()}


def rest_lengths(nodes: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Compute the distance between the nodes of each pair, (n_pairs,) [m]."""
    return np.linalg.norm(nodes[pairs[:, 1]] - nodes[pairs[:, 0]], axis=1)


def make(particles: Particles, springs: settings.Springs | None, elastic: Effect | None = None) -> "Springs":
    """Make the springs of a solid from its Young's modulus, those of a surface or a sheet from ``springs``.

    A kind of stiffness 0 is left out.
    """
    if len(particles.tetrahedra):
        pairs, stiffness = volume_springs(particles)
        return Springs(pairs, stiffness, rest_lengths(particles.nodes, pairs))
    stiffnesses = {kind: getattr(springs, f"{kind}_n_m") for kind in ("structural", "shear", "bending")}
    by_kind = surface_springs(particles.triangles, len(particles.nodes))
    by_kind = {kind: pairs for kind, pairs in by_kind.items() if stiffnesses[kind] > 0.0}
    pairs = np.concatenate(list(by_kind.values()))
    stiffness = np.concatenate([np.full(len(of_kind), float(stiffnesses[kind])) for kind, of_kind in by_kind.items()])
    return Springs(pairs, stiffness, rest_lengths(particles.nodes, pairs))


class Springs(Energy, Stiffness):
    """Springs with E = Σ ½ k (l − l₀)² between pairs of nodes l apart (paper 2, eq. 1 without its damper).

    pairs : (n_springs, 2); stiffness_n_m : (n_springs,) [N/m]; rest_m : (n_springs,) [m]
    Trap: the force of a spring whose ends coincide has no direction and is set to zero, so such a pair stays together
    until another force separates it. Its stiffness is set to k in every direction.
    """

    def __init__(self, pairs: np.ndarray, stiffness_n_m: np.ndarray, rest_m: np.ndarray):
        self.pairs = self.couples = np.ascontiguousarray(pairs)
        self.stiffness_n_m, self.rest_m = stiffness_n_m, rest_m

    def energy(self, x: np.ndarray) -> float:
        return _energy(x, self.pairs, self.stiffness_n_m, self.rest_m)

    def add_force(self, x: np.ndarray, v: np.ndarray | None, force: np.ndarray) -> None:
        _add_force(x, self.pairs, self.stiffness_n_m, self.rest_m, force)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add k [(1 − l₀/l)(I − nnᵀ) + nnᵀ] for each spring to ``values`` (n_blocks, 3, 3) [N/m].

        Only the first coefficient can be negative, in a compressed spring; ``definite`` sets it to zero there.
        """
        _add_stiffness(x, self.pairs, self.stiffness_n_m, self.rest_m, definite, slots, values)


@numba.njit(cache=True)
def direction(x, pair, n):
    """Return the distance of the nodes of a pair; write the unit vector from the first to the second into ``n``."""
    for i in range(3):
        n[i] = x[pair[1], i] - x[pair[0], i]
    length = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    if length > 0.0:
        for i in range(3):
            n[i] /= length
    else:
        n[:] = 0.0
    return length


@numba.njit(cache=True)
def add_pair(slots, values, block):
    """Add ``block`` (3, 3) to a pair's diagonal blocks and subtract it from the other two."""
    for i in range(3):
        for j in range(3):
            values[slots[0, 0], i, j] += block[i, j]
            values[slots[1, 1], i, j] += block[i, j]
            values[slots[0, 1], i, j] -= block[i, j]
            values[slots[1, 0], i, j] -= block[i, j]


@numba.njit(cache=True)
def _energy(x, pairs, stiffness, rest):
    n, total = np.empty(3), 0.0
    for e in range(len(pairs)):
        total += 0.5 * stiffness[e] * (direction(x, pairs[e], n) - rest[e]) ** 2
    return total


@numba.njit(cache=True)
def _add_force(x, pairs, stiffness, rest, force):
    n = np.empty(3)
    for e in range(len(pairs)):
        tension = stiffness[e] * (direction(x, pairs[e], n) - rest[e])
        for i in range(3):
            force[pairs[e, 0], i] += tension * n[i]
            force[pairs[e, 1], i] -= tension * n[i]


@numba.njit(cache=True)
def _add_stiffness(x, pairs, stiffness, rest, definite, slots, values):
    """Add the springs' Hessian k (n nᵀ + (1 − l₀/l) (I − n nᵀ)), ``across`` being 1 − l₀/l, to ``values`` [N/m]."""
    n, block = np.empty(3), np.empty((3, 3))
    for e in range(len(pairs)):
        length = direction(x, pairs[e], n)
        across = 1.0 if length == 0.0 else 1.0 - rest[e] / length
        if definite:
            across = max(across, 0.0)
        for i in range(3):
            for j in range(3):
                block[i, j] = stiffness[e] * (1.0 - across) * n[i] * n[j]
            block[i, i] += stiffness[e] * across
        add_pair(slots[e], values, block)
