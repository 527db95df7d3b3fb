"""Small bodies that tests of several packages share."""

import os
from collections.abc import Callable
from itertools import permutations

from palpate.job import kernel_cache

os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())  # read when numba is imported

import numpy as np
import pytest

from palpate.bodies.body import Body, Material, nest
from palpate.bodies.cylinder import cylinder
from palpate.bodies.mesh import TetMesh
from palpate.solvers.compliance import Compliance, compute_compliance


@pytest.fixture(scope="session")
def soft() -> Material:
    return Material(3000.0, 0.3, 1000.0)


@pytest.fixture(scope="session")
def box() -> Callable[..., TetMesh]:
    """Make a box from the origin, of counts (3,) cells and lengths (3,) [m], each cell cut into six tetrahedra.

    ``jitter`` moves nodes by that part of a cell, those of a face within it.
    """

    def make(counts, lengths, jitter: float = 0.0) -> TetMesh:
        counts, lengths = np.array(counts), np.array(lengths, dtype=float)
        grid = np.stack(np.meshgrid(*(np.arange(c + 1) for c in counts), indexing="ij"), axis=-1).reshape(-1, 3)
        strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
        paths = np.array([np.cumsum([0, *strides[list(order)]]) for order in permutations(range(3))])
        odd = np.linalg.det(np.eye(3)[list(permutations(range(3)))]) < 0
        paths[odd] = paths[odd][:, [0, 1, 3, 2]]
        corners = grid[(grid < counts).all(axis=1)] @ strides
        move = jitter * np.random.default_rng(0).uniform(-1, 1, grid.shape)
        move[(grid == 0) | (grid == counts)] = 0.0
        mesh = TetMesh((grid + move) / counts * lengths, (corners[:, None, None] + paths).reshape(-1, 4))
        assert mesh.volumes.min() > 0
        return mesh

    return make


@pytest.fixture(scope="session")
def beam(soft) -> Body:
    """Paper 1's cylinder, 0.2 m long, refined once and held at one end."""
    return nest("beam", cylinder(0.2, 0.03), 1, np.arange(19), soft)


@pytest.fixture(scope="session")
def slab(box, soft) -> Body:
    """A crooked, skewed box of 96 coarse elements, refined once and held at one end: small, without any symmetry."""
    mesh = box([4, 2, 2], [0.2, 0.1, 0.08], jitter=0.2)
    mesh = TetMesh(mesh.nodes @ np.array([[1.0, 0.05, 0.1], [0.0, 1.0, 0.15], [0.0, 0.07, 1.0]]), mesh.tetrahedra)
    return nest("slab", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)


@pytest.fixture(scope="session")
def slab_compliance(slab) -> Compliance:
    return compute_compliance(slab, 0.0)


@pytest.fixture(scope="session")
def rotation() -> Callable[[float], np.ndarray]:
    """The rotation (3, 3) by an angle [rad] about a skew axis, by Rodrigues' formula."""
    x, y, z = np.array([1.0, -2.0, 3.0]) / np.sqrt(14.0)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return lambda angle: np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
