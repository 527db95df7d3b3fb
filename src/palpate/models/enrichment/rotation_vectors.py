"""Turn vectors by rotation vectors, and find those of a mesh's nodes from a small displacement."""

import numba
import numpy as np
from scipy import sparse

from palpate.bodies.mesh import TetMesh
from palpate.effects.linear_elements import shape_gradients


class NodalSpins:
    """Rotation vectors ½ curl u of a mesh's nodes: the volume-weighted mean of the elements around each."""

    def __init__(self, mesh: TetMesh):
        self._tetrahedra = mesh.tetrahedra
        self._gradients, volumes = shape_gradients(mesh)
        rows, columns = mesh.tetrahedra.ravel(), np.repeat(np.arange(len(volumes)), 4)
        around = sparse.csr_array((np.repeat(volumes, 4), (rows, columns)), shape=(len(mesh.nodes), len(volumes)))
        self._mean = sparse.diags_array(1.0 / around.sum(axis=1)) @ around

    def of(self, displacement: np.ndarray) -> np.ndarray:
        """Return rotation vectors (n_nodes, 3) [rad] of a small ``displacement`` (n_nodes, 3) [m]; linear in it."""
        curl = np.cross(self._gradients, displacement[self._tetrahedra]).sum(axis=1)
        return self._mean @ (0.5 * curl)


@numba.njit(cache=True)
def turn(spins: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Turn each vector (n, 3) by its rotation vector (n, 3) [rad], by Rodrigues' formula."""
    return _combine(spins, vectors, 0)


@numba.njit(cache=True)
def warp(spins: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Apply to each vector (n, 3) the mean of the rotations by t times its rotation vector (n, 3), 0 ≤ t ≤ 1."""
    return _combine(spins, vectors, 1)


@numba.njit(cache=True)
def _combine(spins, vectors, mean):
    """Return v + p w × v + q w × (w × v), with p and q of the rotation or of its mean."""
    found = np.empty_like(vectors)
    for n in range(len(vectors)):
        w0, w1, w2 = spins[n, 0], spins[n, 1], spins[n, 2]
        v0, v1, v2 = vectors[n, 0], vectors[n, 1], vectors[n, 2]
        squared = w0 * w0 + w1 * w1 + w2 * w2
        if squared < 1e-8:  # the series; what is left out is below rounding
            first, second, third = 1.0 - squared / 6.0, 0.5 - squared / 24.0, 1.0 / 6.0 - squared / 120.0
        else:
            angle = np.sqrt(squared)
            first = np.sin(angle) / angle
            second, third = 2.0 * np.sin(0.5 * angle) ** 2 / squared, (1.0 - first) / squared
        p, q = (second, third) if mean else (first, second)
        c0, c1, c2 = w1 * v2 - w2 * v1, w2 * v0 - w0 * v2, w0 * v1 - w1 * v0
        found[n, 0] = v0 + p * c0 + q * (w1 * c2 - w2 * c1)
        found[n, 1] = v1 + p * c1 + q * (w2 * c0 - w0 * c2)
        found[n, 2] = v2 + p * c2 + q * (w0 * c1 - w1 * c0)
    return found
