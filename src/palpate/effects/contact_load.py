"""A force given to a body at a contact: on one node, or spread over a disc around it."""

import numpy as np

from palpate.bodies.body import Body


def nodal_load(body: Body, level: int, contact: int, force: np.ndarray, radius_m: float) -> np.ndarray:
    """Nodal forces (n_nodes, 3) [N] on ``level`` for a total ``force`` (3,) [N] at coarse node ``contact``.

    ``radius_m`` 0 loads the node alone (paper 1). Otherwise the force spreads over the fine surface like
    1 − (distance/radius)² on the side that faces the same way, and coarser levels get the virtual-work
    equivalent of that load, so that every level is pressed alike.
    """
    load = np.outer(_weights(body, contact, radius_m), force)
    for prolongation in reversed(body.prolongations[level % len(body.levels) :]):
        load = prolongation.T @ load
    return load


def _weights(body: Body, contact: int, radius_m: float) -> np.ndarray:
    """Each fine node's share of the force, (n_fine,), summing to 1."""
    mesh = body.fine
    weights = np.zeros(len(mesh.nodes))
    if radius_m > 0.0:
        distance = np.linalg.norm(mesh.nodes - mesh.nodes[contact], axis=1)
        facing = mesh.normals @ mesh.normals[contact] > 0.0
        weights = np.where(facing, np.clip(1.0 - (distance / radius_m) ** 2, 0.0, None), 0.0) * mesh.areas
    if not weights.any():
        weights[contact] = 1.0
    return weights / weights.sum()
