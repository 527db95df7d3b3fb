"""Quadratic elements' nodes, shape functions and prolongation against polynomials."""

from itertools import product
from math import factorial

import numpy as np
import pytest

from palpate.bodies.mesh import EDGES
from palpate.bodies.refinement import (
    QUADRATURE_POINTS,
    quadratic_gradients,
    quadratic_prolongation,
    refine,
    shape_functions,
    ten_nodes,
)


@pytest.fixture(scope="module")
def levels(box):
    meshes = [box([2, 1, 2], [0.2, 0.1, 0.3], jitter=0.2)]
    for _ in range(2):
        meshes.append(refine(meshes[-1])[0])
    return meshes


def quadratic(x):
    """Three polynomials of degree 2 at points (n, 3)."""
    return np.stack([x[:, 0] ** 2 - 3 * x[:, 1] * x[:, 2], x[:, 2] ** 2 + x[:, 0], x[:, 0] * x[:, 1] - 2.0], axis=1)


def test_ten_nodes_are_the_corners_and_the_midpoints_of_the_finer_mesh(levels):
    coarse, fine, _ = levels
    ten = ten_nodes(coarse)
    assert np.array_equal(ten[:, :4], coarse.tetrahedra)
    assert np.array_equal(fine.nodes[ten[:, 4:]], coarse.nodes[coarse.tetrahedra][:, EDGES].mean(axis=2))
    assert np.array_equal(np.unique(ten), np.arange(len(fine.nodes)))


def test_shape_functions_are_one_at_their_own_node_and_zero_at_the_others():
    nodes = np.vstack([np.eye(4), np.eye(4)[EDGES].mean(axis=1)])
    assert np.abs(shape_functions(nodes) - np.eye(10)).max() < 1e-15
    inside = np.random.default_rng(0).dirichlet(np.ones(4), 20)
    assert np.abs(shape_functions(inside).sum(axis=1) - 1.0).max() < 1e-14


def test_slopes_are_derivatives():
    inside = np.random.default_rng(1).dirichlet(np.ones(4), 20)
    for corner, delta in enumerate(1e-6 * np.eye(4)):
        slope = (shape_functions(inside + delta) - shape_functions(inside - delta)) / 2e-6
        assert np.abs(slope - quadratic_gradients(inside)[:, :, corner]).max() < 1e-9


def test_points_integrate_degree_two_exactly():
    """Σ over the points of a monomial of barycentric coordinates, against a! b! c! d! 3! / (a + b + c + d + 3)!"""
    for powers in product(range(3), repeat=4):
        found = np.prod(QUADRATURE_POINTS**powers, axis=1).mean()
        exact = 6 * np.prod([factorial(p) for p in powers]) / factorial(sum(powers) + 3)
        assert (found == pytest.approx(exact, rel=1e-14)) == (sum(powers) <= 2)


def test_prolongation_is_exact_for_quadratic_polynomials(levels):
    coarse, fine, finest = levels
    matrix = quadratic_prolongation(coarse, fine)
    assert matrix.shape == (len(finest.nodes), len(fine.nodes))
    assert np.abs(matrix @ quadratic(fine.nodes) - quadratic(finest.nodes)).max() < 1e-15
    linear = refine(fine)[1]
    assert np.abs(linear @ quadratic(fine.nodes) - quadratic(finest.nodes)).max() > 1e-4
