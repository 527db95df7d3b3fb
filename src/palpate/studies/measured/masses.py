"""Consistent masses of linear and quadratic tetrahedra."""

from math import factorial

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import EDGES, Mesh
from palpate.bodies.refinement import ten_nodes


def mass_matrix(mesh: Mesh, density_kg_m3: np.ndarray, order: int) -> sparse.csr_array:
    """Compute ∫ ρ Nᵢ Nⱼ, (n, n) [kg], of elements on ``mesh`` with densities (n_elements,) [kg/m³].

    n counts the nodes, and for order 2 the edges after them, as ``ten_nodes`` numbers them.
    """
    elements = mesh.tetrahedra if order == 1 else ten_nodes(mesh)
    count = len(mesh.nodes) + (len(mesh.edges) if order == 2 else 0)
    corners = mesh.nodes[mesh.tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    values = (density_kg_m3 * volumes)[:, None, None] * _unit_masses(order)
    rows = np.repeat(elements, elements.shape[1], axis=1).ravel()
    columns = np.tile(elements, elements.shape[1]).ravel()
    return sparse.coo_array((values.ravel(), (rows, columns)), shape=(count, count)).tocsr()


def _unit_masses(order: int) -> np.ndarray:
    """Compute the mean of Nᵢ Nⱼ over a tetrahedron; that of L₁ᵃ L₂ᵇ L₃ᶜ L₄ᵈ is 6 a! b! c! d! / (a + b + c + d + 3)!."""
    if order == 1:
        return (np.ones((4, 4)) + np.eye(4)) / 20.0
    # each function is Σ f_jk L_j L_k, as 1 is the sum of the coordinates
    forms = np.zeros((10, 4, 4))
    for corner in range(4):
        forms[corner, corner] -= 1.0
        forms[corner, corner, corner] += 2.0
    for edge, (a, b) in enumerate(EDGES, start=4):
        forms[edge, a, b] = 4.0
    means = np.empty((4, 4, 4, 4))
    for place in np.ndindex(4, 4, 4, 4):
        powers = np.bincount(place, minlength=4)
        means[place] = 6.0 * np.prod([factorial(power) for power in powers]) / factorial(7)
    return np.einsum("aij,bkl,ijkl->ab", forms, forms, means)
