"""The connected pieces of particles: what contact keeps apart."""

import numpy as np

from palpate.bodies.particles import Particles
from palpate.bodies.surfaces.tetrahedralize import label_shells


def pieces_of(particles: Particles) -> list[np.ndarray]:
    """List the triangles (m, 3) of each connected piece of the particles, in the order of their first triangles.

    The surfaces around a body and around its cavities belong to one piece, as its tetrahedra connect them.
    """
    labels = label_shells(_cells(particles), len(particles.nodes))[: len(particles.triangles)]
    return [particles.triangles[labels == label] for label in dict.fromkeys(labels.tolist())]


def nodes_of_pieces(particles: Particles) -> list[np.ndarray]:
    """List the nodes (k,) of each of ``pieces_of``, those inside it included."""
    cells = _cells(particles)
    labels = label_shells(cells, len(particles.nodes))
    order = dict.fromkeys(labels[: len(particles.triangles)].tolist())
    return [np.unique(cells[labels == label]) for label in order]


def sizes_of(particles: Particles, pieces: list[np.ndarray]) -> list[float]:
    """Compute the longest side of each piece's box [m], whatever the distance between pieces."""
    return [float(np.ptp(particles.nodes[piece.ravel()], axis=0).max()) for piece in pieces]


def _cells(particles: Particles) -> np.ndarray:
    """Return triples of nodes (t + 2 m, 3) that are connected: the triangles, then two of each tetrahedron."""
    return np.vstack([particles.triangles, particles.tetrahedra[:, :3], particles.tetrahedra[:, 1:]])
