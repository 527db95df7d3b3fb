"""A force on a body at a contact: on one node, or distributed over a disc around it."""

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.mesh import Mesh


def nodal_load(body: Body, level: int, contact: int, force: np.ndarray, radius_m: float) -> np.ndarray:
    """Compute nodal forces (n_nodes, 3) [N] on ``level`` for a total ``force`` (3,) [N] at coarse node ``contact``.

    With ``radius_m`` 0 the force acts on the node alone (paper 1). Otherwise it is distributed over the fine surface,
    and coarser levels get the equivalent load in terms of virtual work, so that all levels have the same load.
    """
    load = np.outer(disc_weights(body.fine, contact, radius_m), force)
    for prolongation in reversed(body.prolongations[level % len(body.levels) :]):
        load = prolongation.T @ load
    return load


def disc_weights(mesh: Mesh, contact: int, radius_m: float) -> np.ndarray:
    """Compute each node's share (n_nodes,) of a force on a disc of ``radius_m`` [m] around node ``contact``.

    The shares are proportional to 1 − (distance/radius)² times the node's area, for nodes whose normal is within 90° of
    that of the contact, and sum to 1. A radius of 0, or one without any such node, loads the contact alone.
    """
    weights = np.zeros(len(mesh.nodes))
    if radius_m > 0.0:
        distance = np.linalg.norm(mesh.nodes - mesh.nodes[contact], axis=1)
        facing = mesh.normals @ mesh.normals[contact] > 0.0
        weights = np.where(facing, np.clip(1.0 - (distance / radius_m) ** 2, 0.0, None), 0.0) * mesh.areas
    if not weights.any():
        weights[contact] = 1.0
    return weights / weights.sum()
