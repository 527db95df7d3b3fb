"""Loads of a case on one mesh: weights of the body and of what hangs on it, forces, and the masses that move along."""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import Mesh
from palpate.studies.measured.experiment import Weight
from palpate.studies.measured.surface_points import disc_points, nearest_points

POINTS = 240
"""Points of a line over which a force is spread evenly; a multiple of the divisions of most meshes."""


def nodal_loads(mesh: Mesh, weights: Sequence[Weight], down: np.ndarray, order: int) -> np.ndarray:
    """Spread the forces of ``weights`` over nodes, (n, 3) [N]; what hangs pulls along ``down`` (3,)."""
    total = np.zeros((len(mesh.nodes) + (len(mesh.edges) if order == 2 else 0), 3))
    for weight in weights:
        up, shares = _places(mesh, weight, order)
        force = weight.weight_n * down if weight.force_n is None else weight.force_n
        total += np.outer(up.T @ shares, force)
    return total


def hung_masses(mesh: Mesh, weights: Sequence[Weight], gravity_m_s2: float, order: int) -> sparse.csr_array:
    """Return ∫ Nᵢ Nⱼ dm, (n, n) [kg], of the masses that hang on the surface and move along; those of forces are 0."""
    count = len(mesh.nodes) + (len(mesh.edges) if order == 2 else 0)
    total = sparse.csr_array((count, count))
    for weight in weights:
        if weight.force_n is None:
            up, shares = _places(mesh, weight, order)
            total = total + up.T @ sparse.diags_array(weight.weight_n / gravity_m_s2 * shares) @ up
    return total.tocsr()


def _places(mesh: Mesh, weight: Weight, order: int) -> tuple[sparse.csr_array, np.ndarray]:
    """Return the map (k, n) to the points that carry a load, and the share (k,) of each."""
    if weight.line_m is not None:
        along = (np.arange(POINTS)[:, None] + 0.5) / POINTS
        points = weight.line_m[0] + along * (weight.line_m[1] - weight.line_m[0])
        return nearest_points(mesh, points, order), np.full(POINTS, 1.0 / POINTS)
    assert weight.at_m is not None  # one of the two, as experiment_of says
    center = nearest_points(mesh, weight.at_m[None], order)
    if weight.radius_m == 0.0:
        return center, np.ones(1)
    rest = mesh.nodes if order == 1 else np.vstack([mesh.nodes, mesh.nodes[mesh.edges].mean(axis=1)])
    up, areas = disc_points(mesh, (center @ rest)[0], weight.radius_m, order)
    return up, areas / areas.sum()
