"""Find how far the coarse deformation turns the material at each node."""

import numba
import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.effects.linear_elements import shape_gradients
from palpate.linalg.polar import signed_svd


class NodalRotations:
    """Rotations of a mesh's nodes: the polar part of the volume-weighted mean deformation gradient around each."""

    def __init__(self, mesh: TetMesh):
        self._tetrahedra = np.ascontiguousarray(mesh.tetrahedra)
        self._gradients, self._volumes = shape_gradients(mesh)

    def at(self, displacement: np.ndarray) -> np.ndarray:
        """Return rotations (n_nodes, 3, 3) for a ``displacement`` (n_nodes, 3) [m]."""
        means = np.zeros((len(displacement), 3, 3))
        _nodal_rotations(displacement, self._tetrahedra, self._gradients, self._volumes, means)
        return means


@numba.njit(cache=True)
def _nodal_rotations(displacement, tetrahedra, gradients, volumes, means):
    u, v, s = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    f = np.empty((3, 3))
    for e in range(len(tetrahedra)):
        for i in range(3):
            for j in range(3):
                f[i, j] = volumes[e] if i == j else 0.0
                for a in range(4):
                    f[i, j] += volumes[e] * displacement[tetrahedra[e, a], i] * gradients[e, a, j]
        for a in range(4):
            means[tetrahedra[e, a]] += f
    for n in range(len(means)):
        signed_svd(means[n], u, s, v)
        for i in range(3):
            for j in range(3):
                means[n, i, j] = u[i, 0] * v[j, 0] + u[i, 1] * v[j, 1] + u[i, 2] * v[j, 2]
