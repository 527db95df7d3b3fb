"""A force given to a body at a contact: on one node, or spread over a disc around it."""

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.mesh import Mesh


def nodal_load(body: Body, level: int, contact: int, force: np.ndarray, radius_m: float) -> np.ndarray:
    """Nodal forces (n_nodes, 3) [N] on ``level`` for a total ``force`` (3,) [N] at coarse node ``contact``.

    ``radius_m`` 0 loads the node alone (paper 1). Otherwise the force spreads over the fine surface, and coarser
    levels get the virtual-work equivalent of that load, so that every level is pressed alike.
    """
    load = np.outer(disc_weights(body.fine, contact, radius_m), force)
    for prolongation in reversed(body.prolongations[level % len(body.levels) :]):
        load = prolongation.T @ load
    return load


def disc_weights(mesh: Mesh, contact: int, radius_m: float) -> np.ndarray:
    """Each node's share of a force spread over a disc of ``radius_m`` [m] around node ``contact``, (n_nodes,).

    Like 1 − (distance/radius)² times the node's area, on the side that faces the same way; the shares sum to 1.
    A radius of 0, or one that reaches no node with an area, gives everything to the contact itself.
    """
    weights = np.zeros(len(mesh.nodes))
    if radius_m > 0.0:
        distance = np.linalg.norm(mesh.nodes - mesh.nodes[contact], axis=1)
        facing = mesh.normals @ mesh.normals[contact] > 0.0
        weights = np.where(facing, np.clip(1.0 - (distance / radius_m) ** 2, 0.0, None), 0.0) * mesh.areas
    if not weights.any():
        weights[contact] = 1.0
    return weights / weights.sum()
