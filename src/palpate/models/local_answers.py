"""The dents under an instrument, which modes of a body lack: responses to forces at nodes of its surface.

Few modes bend a body as its strokes do, and are too stiff where an instrument touches. The rest of the linear response
to the nodal forces f there, w = C f with C = K⁻¹ − Φ Φᵀ (residual flexibility; MacNeal 1971), makes the body at rest as
soft as all elements are. C is known for every node that may be touched, and turns with the surface there.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numba
import numpy as np
from scipy.linalg.lapack import dpotrf, dpotri

from palpate.errors import NotConverged
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.fem_statics import coordinates_of
from palpate.solvers.indentation import ContactPoints

SOFTER = 1.2
"""Compliance under an instrument over that at rest: elements that are pressed together resist turning less. Between 1
and 1.35 it is the best for four strokes of the liver, whose errors are 0.5 to 1.7 % with it."""
RESIDUAL = 1e-3
"""Relative residual of linear answers."""
TOGETHER, NODES = 60, 6
"""Loads that are answered at once, and nodes of a triangle of quadratic elements."""
RIDGE = 1e-6
"""Added to the diagonal of compliances, relative, so that nodes that move together have an inverse."""


class Dent(NamedTuple):
    """Forces (c, 3) [N] at the nodes (c,) of those in reach, along axes that ``turn`` (3, 3) turns."""

    nodes: np.ndarray
    forces: np.ndarray
    turn: np.ndarray


FLAT = Dent(np.zeros(0, dtype=int), np.zeros((0, 3)), np.eye(3))


@dataclass(frozen=True, eq=False)
class LocalAnswers:
    """Residual compliance of k surface nodes that instruments may touch.

    nodes : (k,) their numbers; rest, modes : places (k, 3) [m] and rows (3k, r) of the modes
    own : compliance (k, k, 3, 3) of these nodes [m/N], float32, by pairs of nodes, as a step reads few of them
    corners : compliance (3k, 3c) from these to the c corners of elements
    weights, places : (q, 6) of each contact point, shape functions of its triangle and the nodes' numbers among the k;
        held nodes have no weight
    """

    nodes: np.ndarray
    rest: np.ndarray
    modes: np.ndarray
    own: np.ndarray
    corners: np.ndarray
    weights: np.ndarray
    places: np.ndarray

    def field(self, dent: Dent, nodes: np.ndarray) -> np.ndarray:
        """Return the displacements (m, 3) [m] of a ``dent`` at ``nodes`` (m,)."""
        return pushed(self.own, nodes, dent.nodes, dent.forces) @ dent.turn.T

    def of_corners(self, dent: Dent) -> np.ndarray:
        """Return the displacements (c, 3) [m] of all corners."""
        pushes = dent.forces.astype(np.float32).ravel()
        return (pushes @ self.corners[coordinates_of(dent.nodes)]).reshape(-1, 3) @ dent.turn.T

    def stiffness(self, nodes: np.ndarray) -> np.ndarray:
        """Return the inverse (3m, 3m) [N/m] of the compliance of ``nodes`` (m,); NotConverged if it has none."""
        if not len(nodes):
            return np.zeros((0, 0))
        compliance = self.own[nodes[:, None], nodes].transpose(0, 2, 1, 3).reshape(3 * len(nodes), -1).astype(float)
        compliance[np.diag_indices(len(compliance))] *= 1.0 + RIDGE
        lower, failed = dpotrf(compliance, lower=1)
        if failed:
            raise NotConverged("the answers of a surface to forces at its nodes are not positive", [])
        inverse = dpotri(lower, lower=1)[0]
        return np.tril(inverse) + np.tril(inverse, -1).T


@numba.njit(cache=True, error_model="numpy")
def turned(matrix, turn):
    """Return a symmetric ``matrix`` (3m, 3m) between nodes with each 3 × 3 block B replaced by ``turn`` B ``turn``ᵀ."""
    product, half = np.empty_like(matrix), np.empty((3, 3))
    for a in range(0, len(matrix), 3):
        for b in range(0, a + 3, 3):
            for i in range(3):
                for j in range(3):
                    half[i, j] = 0.0
                    for k in range(3):
                        half[i, j] += turn[i, k] * matrix[a + k, b + j]
            for i in range(3):
                for j in range(3):
                    value = 0.0
                    for k in range(3):
                        value += half[i, k] * turn[j, k]
                    product[a + i, b + j] = product[b + j, a + i] = value
    return product


def local_answers(elements: ElementsAtRest, modes: np.ndarray, points: ContactPoints, corners: int) -> LocalAnswers:
    """Compute SOFTER (K⁻¹ − Φ Φᵀ) of free nodes of ``points``, ``modes`` Φ; the first ``corners`` nodes are corners."""
    interpolation, count = points.interpolation.tocsr(), len(elements.rest)
    free = np.setdiff1d(interpolation.indices, elements.held)
    dof, flat_modes = coordinates_of(free), modes.reshape(3 * count, -1)
    c_free, c_corners = np.empty((len(dof), len(dof)), np.float32), np.empty((len(dof), 3 * corners), np.float32)
    for start in range(0, len(dof), TOGETHER):  # responses to the forces, batch by batch
        batch = slice(start, start + TOGETHER)
        loads = np.zeros((3 * count, len(dof[batch])))
        loads[dof[batch], np.arange(loads.shape[1])] = SOFTER
        responses = elements.solve(loads.reshape(count, 3, -1), RESIDUAL).reshape(loads.shape)
        responses -= SOFTER * (flat_modes @ flat_modes[dof[batch]].T)
        c_free[:, batch], c_corners[batch] = responses[dof], responses[: 3 * corners].T
    numbers = np.full(count, -1)
    numbers[free] = np.arange(len(free))
    weights, places = np.zeros((len(points.areas), NODES)), np.zeros((len(points.areas), NODES), dtype=np.int64)
    for q, (start, end) in enumerate(pairwise(interpolation.indptr)):  # weights and nodes of each contact point
        at_point = numbers[interpolation.indices[start:end]]
        weights[q, : end - start] = np.where(at_point < 0, 0.0, interpolation.data[start:end])
        places[q, : end - start] = np.maximum(at_point, 0)
    by_node = np.ascontiguousarray((0.5 * (c_free + c_free.T)).reshape(len(free), 3, -1, 3).transpose(0, 2, 1, 3))
    return LocalAnswers(free, elements.rest[free], flat_modes[dof], by_node, c_corners, weights, places)


def turn_of(rest: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) that best takes places ``rest`` (m, 3) to ``moved`` (m, 3), apart from a shift."""
    left, _, right = np.linalg.svd((moved - moved.mean(axis=0)).T @ (rest - rest.mean(axis=0)))
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    return left @ right


@numba.njit(cache=True, error_model="numpy")
def pushed(blocks, nodes, at, forces):
    """Return displacements (m, 3) of ``nodes`` (m,) under ``forces`` (c, 3) on the nodes ``at`` (c,).

    blocks : (k, k, 3, 3) compliance between nodes
    """
    displacement = np.zeros((len(nodes), 3))
    for a in range(len(nodes)):
        for b in range(len(at)):
            block = blocks[nodes[a], at[b]]
            for i in range(3):
                for j in range(3):
                    displacement[a, i] += block[i, j] * forces[b, j]
    return displacement


@numba.njit(cache=True, error_model="numpy")
def carried(rest, weights, places, points, moved, numbers):
    """Return the places (c, 3) of ``points`` (c,) of all contact points, which surface nodes carry along.

    rest : (q, 3) places of all points at rest; weights, places : (q, 6) as of ``LocalAnswers``
    moved : (m, 3) displacements of some nodes; numbers : (k,) of each node among these
    """
    carried_points = np.empty((len(points), 3))
    for c in range(len(points)):
        q = points[c]
        carried_points[c] = rest[q]
        for a in range(weights.shape[1]):  # nodes of its triangle
            for i in range(3):
                carried_points[c, i] += weights[q, a] * moved[numbers[places[q, a]], i]
    return carried_points


def numbered(nodes: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return which of ``count`` nodes are in ``nodes``, (m,) increasing, and the number of each among them, or −1."""
    numbers = np.full(count, -1)
    numbers[nodes.ravel()] = 0
    chosen = np.flatnonzero(numbers == 0)
    numbers[chosen] = np.arange(len(chosen))
    return chosen, numbers
