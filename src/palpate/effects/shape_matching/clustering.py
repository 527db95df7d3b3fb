"""Clusters of particles for shape matching: overlapping groups, from tetrahedra or from cubes."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from palpate.bodies.particles import Particles
from palpate.errors import InputError

KINDS = ("one", "tetrahedra", "each_tetrahedron", "cubes")


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


def make_clusters(particles: Particles, settings: dict) -> Clusters:
    """Make the clusters of a ``kind``, one of KINDS, separately for each connected piece of the mesh.

    one : the whole piece
    tetrahedra : one for each tetrahedron that is not yet in a cluster, with all tetrahedra that share a node with it,
        so that each tetrahedron is inside a cluster and the clusters of a piece are connected
    each_tetrahedron : one for each tetrahedron, with all tetrahedra that share a node with it, as paper 3 says
    cubes : of side ``edge_m`` [m], at equal distances in the piece's box; neighbours share at least the fraction
        ``overlap``

    Müller, Heidelberger, Teschner, Gross 2005, section 4.3. Particles without a mesh are one piece.

    Raises InputError for unusable settings, and if cubes share too few particles to hold a piece together.
    """
    count, kind = len(particles.nodes), settings["kind"]
    if kind not in KINDS:
        raise InputError(f"shape_matching.clusters.kind {kind} is unknown: choose one of {', '.join(KINDS)}")
    edges = _edges(particles)
    pieces = _pieces(edges, count)
    if kind == "one":
        groups = pieces
    elif kind in ("tetrahedra", "each_tetrahedron"):
        if not len(particles.tetrahedra):
            raise InputError(f"shape_matching.clusters.kind is {kind}, and {particles.name} has none: use cubes")
        groups = _neighbourhoods(particles.tetrahedra, count, each=kind == "each_tetrahedron")
    else:
        if "edge_m" not in settings:
            raise InputError(
                f"shape_matching.clusters of {particles.name} lacks edge_m; give the cubes' edge in metres, such as "
                f"{particles.size / 3:.2g}."
            )
        groups = [piece[g] for piece in pieces for g in _cubes(particles.nodes[piece], settings)]
    clusters = Clusters(np.concatenate(groups), np.cumsum([0, *map(len, groups)]))
    if len(clusters.shared_by) < count or not clusters.shared_by.all():
        raise InputError(f"{particles.name} has particles that belong to no tetrahedron: use cubes or one cluster")
    _check_joined(clusters, edges, count)
    return clusters


def _edges(particles: Particles) -> np.ndarray:
    """Return pairs (n_pairs, 2) of the first node of each triangle and tetrahedron and each of its other nodes."""
    cells = (particles.triangles, particles.tetrahedra)
    return np.concatenate([np.stack([c[:, 0], c[:, j]], axis=1) for c in cells for j in range(1, c.shape[1])])


def _pieces(edges: np.ndarray, count: int) -> list[np.ndarray]:
    if not len(edges):
        return [np.arange(count)]
    number, labels = connected_components(_graph(edges, count), directed=False)
    order = np.argsort(labels, kind="stable")
    return np.split(order, np.cumsum(np.bincount(labels, minlength=number))[:-1])


def _graph(edges: np.ndarray, count: int) -> sparse.coo_array:
    return sparse.coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))


def _neighbourhoods(tetrahedra: np.ndarray, count: int, each: bool) -> list[np.ndarray]:
    index = np.repeat(np.arange(len(tetrahedra)), 4)
    around = sparse.csr_array((np.ones(len(index), dtype=bool), (tetrahedra.ravel(), index)), (count, len(tetrahedra)))
    covered, groups = np.zeros(len(tetrahedra), dtype=bool), []
    for seed in range(len(tetrahedra)):
        if covered[seed] and not each:
            continue
        near = np.concatenate([around.indices[around.indptr[n] : around.indptr[n + 1]] for n in tetrahedra[seed]])
        covered[near] = True
        groups.append(np.unique(tetrahedra[near]))
    return groups


def _cubes(nodes: np.ndarray, settings: dict) -> list[np.ndarray]:
    """Return the members of each cube that is not empty, without repetition."""
    edge, overlap = settings["edge_m"], settings["overlap"]
    if not 0 < edge < np.inf:
        raise InputError(f"shape_matching.clusters.edge_m is {edge}: give a side above 0 m")
    if not 0 <= overlap < 1:
        raise InputError(
            f"shape_matching.clusters.overlap is {overlap}: give a fraction of a cube, at least 0 and below 1"
        )
    low, length = nodes.min(axis=0), np.ptp(nodes, axis=0)
    slack = 1e-9 * edge
    counts = [1 + max(0, int(np.ceil((span - edge - slack) / ((1 - overlap) * edge)))) for span in length]
    if np.prod([float(n) for n in counts]) > 8 * len(nodes) + 8:
        raise InputError(
            f"shape_matching.clusters needs too many cubes for {len(nodes)} particles: increase edge_m, reduce overlap"
        )
    inside: list[np.ndarray] = []
    groups: dict[bytes, np.ndarray] = {}
    for place, span, number in zip((nodes - low).T, length, counts, strict=True):
        starts = np.linspace(0.0, max(span - edge, 0.0), number)
        inside.append((place[:, None] >= starts - slack) & (place[:, None] <= starts + edge + slack))
    for i, j, k in np.ndindex(*counts):
        group = np.flatnonzero(inside[0][:, i] & inside[1][:, j] & inside[2][:, k])
        if len(group):
            groups.setdefault(group.tobytes(), group)
    return list(groups.values())


def _check_joined(clusters: Clusters, edges: np.ndarray, count: int) -> None:
    firsts = np.repeat(clusters.members[clusters.starts[:-1]], np.diff(clusters.starts))
    shared = np.stack([firsts, clusters.members], axis=1)
    parts = connected_components(_graph(shared, count), directed=False)[0]
    if parts > connected_components(_graph(np.concatenate([shared, edges]), count), directed=False)[0]:
        raise InputError(
            "shape_matching.clusters share too few particles to hold the body together: increase edge_m or overlap"
        )
