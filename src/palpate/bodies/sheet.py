"""Flat sheets, such as cloth or membranes: triangles with a thickness."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.bodies.lattice import cut_lattice
from palpate.bodies.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Sheet(Mesh):
    """A triangulated sheet in its rest state, with the properties of a ``TetMesh`` and without tetrahedra.

    nodes : (n_nodes, 3) float64 [m]
    triangles : (n_triangles, 3) int64, consistently wound
    thickness_m : of the material, half of it on either side of the triangles [m]
    """

    nodes: np.ndarray
    triangles: np.ndarray
    thickness_m: float

    @property
    def tetrahedra(self) -> np.ndarray:
        """Empty array, (0, 4) int64."""
        return np.empty((0, 4), dtype=np.int64)

    @cached_property
    def edges(self) -> np.ndarray:
        """Triangle edges, (n_edges, 2), each once, smaller node first, in lexicographic order."""
        return np.unique(np.sort(self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)


def sheet(sizes_m: list[float], divisions: list[int], thickness_m: float) -> Sheet:
    """Build a sheet from the origin to ``sizes_m`` (2,) [m] in the x–y plane, of ``divisions`` (2,) cells.

    Each cell has two triangles, whose normal is +z; the diagonals alternate ("union jack"), because with diagonals of
    one direction a sheet drapes and shears askew.
    """
    points, triangles = cut_lattice(divisions)
    nodes = np.zeros((len(points), 3))
    nodes[:, :2] = points / np.array(divisions) * np.array(sizes_m, dtype=float)
    a, b, c = (nodes[triangles[:, i]] for i in range(3))
    back = np.cross(b - a, c - a)[:, 2] < 0
    triangles[back] = triangles[back][:, ::-1]
    return Sheet(nodes, triangles, float(thickness_m))
