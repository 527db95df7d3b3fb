"""Shape matching: each cluster of particles moves towards the best fit of its rest shape.

Clusters overlap. Paper 3, chapter 3, inverts Σ m q̃ q̃ᵀ. Here the terms q̃ are made orthonormal once, at rest: φ with
Σ μ φ = 0 and Σ μ φ φᵀ = I, where μ are the particles' shares of their cluster's mass. Then H = Σ μ x φᵀ gives the best
fit c + H φ, with q = L φ and A_pq = M H Lᵀ, and terms that are dependent in a flat, straight or tiny cluster are zero.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numba
import numpy as np
from scipy import sparse

from palpate.bodies.mesh import components
from palpate.bodies.particles import Particles
from palpate.effects import settings
from palpate.effects.effect import Effect, Goals
from palpate.errors import InputError
from palpate.linalg.polar import nearest


@dataclass(frozen=True, eq=False)
class Clusters:
    """Groups of particles; each particle is in at least one.

    members : (n_members,) numbers of particles, those of cluster c at ``starts[c]:starts[c + 1]``, increasing
    starts : (n_clusters + 1,)
    """

    members: np.ndarray
    starts: np.ndarray

    @property
    def shared_by(self) -> np.ndarray:
        """The number of clusters of each particle, (n,)."""
        return np.bincount(self.members)


def make_clusters(particles: Particles, options: settings.Clusters) -> Clusters:
    """Make the clusters of a ``kind``, separately for each connected piece of the mesh.

    one : the whole piece
    tetrahedra : one for each tetrahedron that is not yet in a cluster, with all tetrahedra that share a node with it,
        so that each tetrahedron is inside a cluster and the clusters of a piece are connected; from the piece's middle
        outward, and all at once of those equally far, so that clusters of a symmetric mesh are symmetric
    each_tetrahedron : one for each tetrahedron, with all tetrahedra that share a node with it, as paper 3 says
    cubes : of side ``edge_m`` [m], at equal distances in the piece's box; neighbours share at least the fraction
        ``overlap``

    Müller, Heidelberger, Teschner, Gross 2005, section 4.3. Particles without a mesh are one piece.

    Raises InputError for too many cubes, and if they share too few particles to hold a piece together.
    """
    count, kind = len(particles.nodes), options.kind
    edges = _edges(particles)
    pieces = _pieces(edges, count)
    if kind == "one":
        groups = pieces
    elif kind in ("tetrahedra", "each_tetrahedron"):
        if not len(particles.tetrahedra):
            raise InputError(f"shape_matching.clusters.kind is {kind}, and {particles.name} has none: use cubes")
        shells = _shells(particles, pieces) if kind == "tetrahedra" else None
        groups = _neighbourhoods(particles.tetrahedra, count, shells)
    else:
        groups = [piece[g] for piece in pieces for g in _cubes(particles.nodes[piece], options)]
    clusters = Clusters(np.concatenate(groups), np.cumsum([0, *map(len, groups)]))
    if len(clusters.shared_by) < count or not clusters.shared_by.all():
        raise InputError(f"{particles.name} has particles that belong to no tetrahedron: use cubes or one cluster")
    _check_joined(clusters, edges, count)
    return clusters


def _edges(particles: Particles) -> np.ndarray:
    """Return pairs (n_pairs, 2) of the first node of each triangle and tetrahedron with each of its other nodes."""
    cells = (particles.triangles, particles.tetrahedra)
    return np.concatenate([np.stack([c[:, 0], c[:, j]], axis=1) for c in cells for j in range(1, c.shape[1])])


def _pieces(edges: np.ndarray, count: int) -> list[np.ndarray]:
    if not len(edges):
        return [np.arange(count)]
    labels = components(edges, count)
    return np.split(np.argsort(labels, kind="stable"), np.cumsum(np.bincount(labels))[:-1])


ALIKE = 1e-6
"""Difference of distances, over the body's size, that rounding may make."""


def _shells(particles: Particles, pieces: list[np.ndarray]) -> list[np.ndarray]:
    """Return groups of tetrahedra at equal distances from the middle of their piece, the nearest group first."""
    centres = particles.nodes[particles.tetrahedra].mean(axis=1)
    away = np.empty(len(centres))
    for piece in pieces:
        own = np.isin(particles.tetrahedra[:, 0], piece)
        away[own] = np.linalg.norm(centres[own] - particles.nodes[piece].mean(axis=0), axis=1)
    order = np.argsort(away, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(away[order]) > ALIKE * particles.size) + 1)


def _neighbourhoods(tetrahedra: np.ndarray, count: int, shells: Iterable[np.ndarray] | None) -> list[np.ndarray]:
    """Return for each tetrahedron the nodes of all tetrahedra that have a node in common with it.

    shells : groups of tetrahedra in their order, or None; with them, a neighbour of an earlier tetrahedron gets none
    """
    cell = np.repeat(np.arange(len(tetrahedra)), 4)
    around = sparse.csr_array((np.ones(len(cell), dtype=bool), (tetrahedra.ravel(), cell)), (count, len(tetrahedra)))
    covered, groups = np.zeros(len(tetrahedra), dtype=bool), []
    for shell in [np.arange(len(tetrahedra))] if shells is None else shells:
        for seed in shell[~covered[shell]]:
            near = np.concatenate([around.indices[around.indptr[n] : around.indptr[n + 1]] for n in tetrahedra[seed]])
            covered[near] = shells is not None
            groups.append(np.unique(tetrahedra[near]))
    return groups


def _cubes(nodes: np.ndarray, options: settings.Clusters) -> list[np.ndarray]:
    """Return the particles (k,) in each cube that is not empty, each set once; inside : (n, cubes) bool by axis."""
    edge, overlap = options.edge_m, options.overlap
    if edge is None:
        raise InputError("shape_matching.clusters lacks edge_m; give the edge of the cubes in metres.")
    if not overlap < 1:
        raise InputError(f"shape_matching.clusters.overlap is {overlap}: give a fraction of a cube below 1")
    lower, lengths = nodes.min(axis=0), np.ptp(nodes, axis=0)
    slack = 1e-9 * edge
    counts = [1 + max(0, int(np.ceil((span - edge - slack) / ((1 - overlap) * edge)))) for span in lengths]
    if np.prod([float(n) for n in counts]) > 8 * len(nodes) + 8:
        raise InputError(
            f"shape_matching.clusters needs too many cubes for {len(nodes)} particles: increase edge_m, reduce overlap"
        )
    inside: list[np.ndarray] = []
    groups: dict[bytes, np.ndarray] = {}
    for coordinate, span, count in zip((nodes - lower).T, lengths, counts, strict=True):
        starts = np.linspace(0.0, max(span - edge, 0.0), count)
        inside.append((coordinate[:, None] >= starts - slack) & (coordinate[:, None] <= starts + edge + slack))
    for i, j, k in np.ndindex(*counts):
        group = np.flatnonzero(inside[0][:, i] & inside[1][:, j] & inside[2][:, k])
        if len(group):
            groups.setdefault(group.tobytes(), group)
    return list(groups.values())


def _check_joined(clusters: Clusters, edges: np.ndarray, count: int) -> None:
    firsts = np.repeat(clusters.members[clusters.starts[:-1]], np.diff(clusters.starts))
    shared = np.stack([firsts, clusters.members], axis=1)
    if components(shared, count).max() > components(np.concatenate([shared, edges]), count).max():
        raise InputError(
            "shape_matching.clusters share too few particles to hold the body together: increase edge_m or overlap"
        )


TERMS = {"rigid": 3, "linear": 3, "quadratic": 9}
"""Entries of q̃ = (x, y, z, x², y², z², xy, yz, zx) in each mode."""

DEPENDENT = 1e-6
"""A term is dependent if its part orthogonal to the earlier terms is below this, relative to the cluster's size."""


@numba.njit(cache=True)
def orthonormal_terms(nodes, masses, members, starts, terms):
    """Compute ``terms`` orthonormal functions φ for each cluster, and the frames L that give its rest shape q = L φ.

    nodes : (n, 3) [m]; masses : (n_members,) [kg] of each member in its cluster; members, starts : of ``Clusters``
    Returns fractions μ (n_members,) of the clusters' masses, terms φ (n_members, terms), frames (n_clusters, 3, 3) [m],
    and ranks (n_clusters,), how many of the first three terms are not zero: 2 in a plane, 1 on a line, 0 in a point.
    """
    shares, basis = np.empty(len(members)), np.zeros((len(members), terms))
    frames, ranks = np.zeros((len(starts) - 1, 3, 3)), np.zeros(len(starts) - 1, dtype=np.int64)
    for c in range(len(starts) - 1):
        begin, end = starts[c], starts[c + 1]
        mass = masses[begin:end].sum()
        shares[begin:end] = masses[begin:end] / mass
        share, phi = shares[begin:end], basis[begin:end]
        centre, square = np.zeros(3), 0.0
        for n in range(begin, end):
            for i in range(3):
                centre[i] += shares[n] * nodes[members[n], i]
        for n in range(begin, end):
            for i in range(3):
                basis[n, i] = nodes[members[n], i] - centre[i]
                square += shares[n] * basis[n, i] ** 2
        radius = math.sqrt(square)
        if radius == 0.0:
            phi[:] = 0.0
            continue
        phi[:, :3] /= radius
        if basis.shape[1] == 9:
            for n in range(begin, end):
                x, y, z = basis[n, 0], basis[n, 1], basis[n, 2]
                basis[n, 3], basis[n, 4], basis[n, 5] = x * x, y * y, z * z
                basis[n, 6], basis[n, 7], basis[n, 8] = x * y, y * z, z * x
        for j in range(basis.shape[1]):
            phi[:, j] -= (share * phi[:, j]).sum()
            for _ in range(2):  # once is inaccurate for nearly dependent terms; twice is enough
                for k in range(j):
                    projection = (share * phi[:, k] * phi[:, j]).sum()
                    phi[:, j] -= projection * phi[:, k]
                    if j < 3:
                        frames[c, j, k] += radius * projection
            norm = math.sqrt((share * phi[:, j] ** 2).sum())
            if norm < DEPENDENT:
                phi[:, j] = 0.0
                continue
            phi[:, j] /= norm
            if j < 3:
                frames[c, j, j] = radius * norm
                ranks[c] += 1
    return shares, basis, frames, ranks


@numba.njit(cache=True)
def fit(x, members, shares, basis, first, last, centre, h):
    """Compute the centre of mass (3,) and H = Σ μ x φᵀ (3, terms) of the cluster with members ``first`` to ``last``.

    Sums are relative to the first particle, so that they are accurate far from the origin.
    """
    x0, y0, z0 = x[members[first], 0], x[members[first], 1], x[members[first], 2]
    cx, cy, cz = 0.0, 0.0, 0.0
    h[:] = 0.0
    for n in range(first, last):
        i = members[n]
        px, py, pz = shares[n] * (x[i, 0] - x0), shares[n] * (x[i, 1] - y0), shares[n] * (x[i, 2] - z0)
        cx += px
        cy += py
        cz += pz
        for j in range(basis.shape[1]):
            h[0, j] += px * basis[n, j]
            h[1, j] += py * basis[n, j]
            h[2, j] += pz * basis[n, j]
    centre[0], centre[1], centre[2] = x0 + cx, y0 + cy, z0 + cz


@numba.njit(cache=True)
def moment(h, frame, out):
    """Compute A_pq/M = H Lᵀ (3, 3) [m²], whose rotation is that of the cluster."""
    for i in range(3):
        for j in range(3):
            out[i, j] = h[i, 0] * frame[j, 0] + h[i, 1] * frame[j, 1] + h[i, 2] * frame[j, 2]


@numba.njit(cache=True)
def determinant(a):
    """Compute the determinant of the first three columns of ``a``."""
    return (
        a[0, 0] * (a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1])
        + a[0, 1] * (a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2])
        + a[0, 2] * (a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0])
    )


OVERLAPS = ("mean", "sum")
"""Motions of a particle in several clusters: to the mean of its goals, or towards each of them."""

HALF, DOUBLE = 0.5, 2.0
"""Range of volumes, relative to rest, in which the linear mode restores the volume completely."""


def make(particles: Particles, matching: settings.ShapeMatching, elastic: Effect | None = None) -> "ShapeMatching":
    """Make the shape matching of ``particles``; elastic : not used, all makers of effects take it.

    Raises InputError for clusters that do not hold the body together, a body of several stiffnesses, or goals whose sum
    may be unstable.
    """
    particles.refuse_regions("shape matching has")
    clusters = make_clusters(particles, matching.clusters)
    matched = ShapeMatching(particles, clusters, matching.mode, matching.alpha, matching.beta, matching.goals == "sum")
    # where goals are added, alpha is that of a particle in most clusters; 4 is the limit of stability of one cluster
    if not matched.alpha < 4.0:
        raise InputError(
            f"shape_matching.alpha is {matching.alpha}, and with goals: sum a particle in {matched.most} clusters "
            f"is sure to stay stable below {4.0 / matched.most:.3g} only; lower alpha, or choose goals: mean."
        )
    return matched


class ShapeMatching(Goals):
    """Goals of overlapping clusters (Müller, Heidelberger, Teschner, Gross 2005; paper 3, chapter 3).

    frames : (n_clusters, 3, 3) [m], the rest shape as q = L φ; plasticity changes it in place
    alpha : fraction of the way to its goal that a particle moves in a step; with ``add`` times ``most``, the largest
        number of clusters that a particle is in

    A particle's mass is divided equally among its clusters, and its goal is the mean of theirs. The goals of each
    cluster conserve its linear and angular momentum, so α (g − x) conserves that of the body for any overlap.

    ``add`` follows the paper to the letter: each cluster has the whole masses of its particles and moves them by its
    own α (g − x), so that a particle in k clusters moves by the sum, as with kα towards the mean. Momentum is conserved
    too, but stiffness depends on the overlap, and no step is sure to be stable with α above 4/``most``.

    Two changes to the paper: the mean of the terms q̃ is subtracted, as otherwise quadratic goals move the centre of
    mass; and det(A)^(−1/3) of the linear mode, infinite for a flat cluster, is constant above DOUBLE the volume, and
    below HALF decreases linearly to 1 at volume 0 and stays 1 for an inverted cluster. Without these bounds an undamped
    body that starts flat or inverted reaches a thousand times its size after 2000 steps with α = 1; with them, tens of
    times after 10 000, still growing. So use damping if a body may start in such a state.

    Traps: the force α m (g − x)/h² depends on the step, and except in the rigid mode it is not a gradient, so there is
    no energy. With β = 1 goals follow any linear or quadratic shape, inverted ones included. Clusters that share only a
    layer of particles have further shapes of equilibrium, turned inside out, which an extreme start may lead to; with
    clusters that share half of their particles, no such start was found.
    """

    def __init__(
        self, particles: Particles, clusters: Clusters, mode: str, alpha: float, beta: float, add: bool = False
    ):
        self.most = int(clusters.shared_by.max()) if add else 1
        self.alpha, self.clusters, self.mode = alpha * self.most, clusters, mode
        self._beta = 0.0 if mode == "rigid" else beta
        self._weights = 1.0 / clusters.shared_by
        self._pull = (clusters.shared_by / self.most)[:, None] if add else None
        masses = (particles.masses if add else particles.masses * self._weights)[clusters.members]
        self.shares, self.basis, self.frames, self.ranks = orthonormal_terms(
            particles.nodes, masses, clusters.members, clusters.starts, TERMS[mode]
        )
        self._turns = np.tile([1.0, 0.0, 0.0, 0.0], (len(self.ranks), 1))

    def goals(self, x: np.ndarray, out: np.ndarray) -> None:
        """Write the goal positions (n, 3) [m] for positions ``x`` (n, 3) [m] into ``out``.

        The search for each cluster's rotation begins at the previous one. That changes the result by rounding errors
        only, unless several rotations are equally near.
        """
        rest = (self.clusters.members, self.clusters.starts, self.shares, self.basis, self.frames, self.ranks)
        _goals(x, *rest, self._beta, self.mode == "linear", self._weights, self._turns, out)
        if self._pull is not None:
            out[:] = x + self._pull * (out - x)


@numba.njit(cache=True, error_model="numpy")
def _goals(x, members, starts, shares, basis, frames, ranks, beta, keep_volume, weights, turns, out):
    """Write each particle's mean goal to ``out`` (n, 3) [m]: centre + (β H + (1 − β) R L) φ, R nearest to H Lᵀ."""
    terms = basis.shape[1]
    centre, h, a, r, work = np.empty(3), np.empty((3, terms)), np.empty((3, 3)), np.empty((3, 3)), np.empty((4, 3, 3))
    out[:] = 0.0
    for c in range(len(ranks)):
        begin, end = starts[c], starts[c + 1]
        fit(x, members, shares, basis, begin, end, centre, h)
        moment(h, frames[c], a)
        nearest(a, turns[c], work, r)
        fit_share = beta
        if keep_volume and ranks[c] == 3:
            fit_share *= _volume_factor(determinant(h) / determinant(frames[c]))
        for i in range(3):
            for j in range(terms):
                h[i, j] *= fit_share
            for j in range(3):
                rigid = r[i, 0] * frames[c, 0, j] + r[i, 1] * frames[c, 1, j] + r[i, 2] * frames[c, 2, j]
                h[i, j] += (1.0 - beta) * rigid
        for n in range(begin, end):
            gx, gy, gz = centre[0], centre[1], centre[2]
            for j in range(terms):
                gx += h[0, j] * basis[n, j]
                gy += h[1, j] * basis[n, j]
                gz += h[2, j] * basis[n, j]
            i = members[n]
            out[i, 0] += weights[i] * gx
            out[i, 1] += weights[i] * gy
            out[i, 2] += weights[i] * gz


@numba.njit(cache=True, error_model="numpy")
def _volume_factor(volume):
    """Return the factor of a linear map by which it restores the volume; volume : of the map, relative to rest."""
    if volume > HALF:
        return min(volume, DOUBLE) ** (-1.0 / 3.0)
    return 1.0 + max(volume, 0.0) / HALF * (HALF ** (-1.0 / 3.0) - 1.0)
