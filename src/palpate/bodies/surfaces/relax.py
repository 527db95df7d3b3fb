"""Improvement of the worst elements of a tetrahedral mesh, by moving single nodes of theirs."""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import dihedral_angles

ROUNDS = 6
# elements below this smallest dihedral angle [°] are improved
WANTED_DEG = 14.0
# lengths of the moves that are tried, relative to the shortest edge at the node
STEPS = (0.4, 0.15, 0.05)
_STAR = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], dtype=float)
DIRECTIONS = _STAR / np.linalg.norm(_STAR, axis=1, keepdims=True)


def relax(
    nodes: np.ndarray,
    elements: np.ndarray,
    movable: np.ndarray,
    surface: np.ndarray,
    onto: Callable[[np.ndarray, int], np.ndarray] | None,
) -> np.ndarray:
    """Move nodes of bad elements such that the worst element around each becomes better; return all nodes, (n, 3) [m].

    movable : (n,) bool; surface : the surface nodes
    onto : projects places, (k, 3) [m], of the given surface node to the surface on which it has to stay; not needed if
        only inner nodes are movable
    No element that was good becomes worse than the worst beside it was (optimisation-based smoothing, Freitag and
    Ollivier-Gooch 1997, by trial moves in 26 directions).
    """
    nodes = nodes.copy()
    on_surface = np.zeros(len(nodes), dtype=bool)
    on_surface[surface] = True
    entries = np.ones(elements.size, dtype=np.int8)
    around = sparse.csr_array(
        (entries, (elements.ravel(), np.repeat(np.arange(len(elements)), 4))), shape=(len(nodes), len(elements))
    )
    quality = element_quality(nodes, elements)
    for _ in range(ROUNDS):
        bad = np.flatnonzero(quality < WANTED_DEG)
        corners = np.unique(elements[bad])
        changed = False
        for node in corners[movable[corners]]:
            patch = around.indices[around.indptr[node] : around.indptr[node + 1]]
            if quality[patch].min() >= WANTED_DEG:
                continue
            tried = _trial_places(nodes, elements[patch], node)
            if onto is not None and on_surface[node]:
                tried = onto(tried, node)
            found = _best_place(nodes, elements[patch], node, tried, quality[patch].min())
            if found is not None:
                nodes[node], quality[patch] = found
                changed = True
        if not changed:
            break
    return nodes


def element_quality(nodes: np.ndarray, elements: np.ndarray) -> np.ndarray:
    """Compute the smallest dihedral angle [°] of each element, (m,); of an inverted one a negative number."""
    mesh = TetMesh(nodes, elements)
    with np.errstate(invalid="ignore", divide="ignore"):
        angles = dihedral_angles(mesh).min(axis=1)
    return np.where(mesh.volumes > 0, angles, np.minimum(-1e-3, -np.nan_to_num(angles)))


def _trial_places(nodes: np.ndarray, patch: np.ndarray, node: int) -> np.ndarray:
    others = np.unique(patch[patch != node])
    offsets = nodes[others] - nodes[node]
    shortest = np.linalg.norm(offsets, axis=1).min()
    moves = [step * shortest * DIRECTIONS for step in STEPS]
    return nodes[node] + np.vstack([*moves, offsets.mean(axis=0)])


def _best_place(
    nodes: np.ndarray, patch: np.ndarray, node: int, tried: np.ndarray, least: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Find the trial place with the best worst element, and the elements' qualities; None if none is better."""
    copies = np.repeat(nodes[np.newaxis, patch], len(tried), axis=0)
    copies[:, patch == node] = tried[:, np.newaxis]
    flat = copies.reshape(-1, 3)
    quality = element_quality(flat, np.arange(len(flat)).reshape(-1, 4)).reshape(len(tried), len(patch))
    best = int(np.argmax(quality.min(axis=1)))
    return (tried[best], quality[best]) if quality[best].min() > least + 1e-6 else None
