"""Small meshes that the tests of bodies share."""

from itertools import permutations

import numpy as np
import pytest

from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh


@pytest.fixture
def cube() -> TetMesh:
    """The unit cube, 8 nodes, cut into 6 tetrahedra around its diagonal."""
    nodes = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], dtype=float)
    paths = [np.cumsum([0, *(1 << axis for axis in order)]) for order in permutations(range(3))]
    tetrahedra = np.array(paths, dtype=np.int64)
    inverted = TetMesh(nodes, tetrahedra).volumes < 0
    tetrahedra[inverted] = tetrahedra[inverted][:, [1, 0, 2, 3]]
    return TetMesh(nodes, tetrahedra)


@pytest.fixture
def octahedron() -> tuple[np.ndarray, np.ndarray]:
    """A closed surface: 6 points one from the origin, 8 triangles wound outward."""
    points = np.vstack([np.eye(3), -np.eye(3)])
    triangles = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    return points, np.array(triangles, dtype=np.int64)


@pytest.fixture
def material() -> Material:
    return Material(3000.0, 0.3, 1000.0)


@pytest.fixture
def entry() -> dict:
    """A config entry without its kind."""
    return {
        "refinements": 0,
        "young_pa": 3000,
        "poisson": 0.3,
        "density_kg_m3": 1000,
        "anchors": {"plane": {"axis": "z", "side": "min", "depth_m": 0.001}},
    }
