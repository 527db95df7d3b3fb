"""Bad elements become better, and what was good stays good."""

import numpy as np

from palpate.bodies.surfaces.decimate import fibonacci_sphere, triangulate
from palpate.bodies.surfaces.snap import WANTED_DEG, element_quality, relax
from palpate.bodies.surfaces.tetrahedralize import tetrahedralize


def test_a_flattened_element_opens_again():
    points = fibonacci_sphere(60)
    mesh = tetrahedralize(points, triangulate(points))
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.surface)
    nodes = mesh.nodes.copy()
    nodes[inner[0]] = 0.97 * points[np.argmin(np.linalg.norm(points - nodes[inner[0]], axis=1))]
    before = element_quality(nodes, mesh.tetrahedra)
    movable = np.isin(np.arange(len(nodes)), inner)
    moved = relax(nodes, mesh.tetrahedra, movable, mesh.surface, None)
    assert before.min() < 5
    assert element_quality(moved, mesh.tetrahedra).min() >= WANTED_DEG
    assert np.array_equal(moved[mesh.surface], mesh.nodes[mesh.surface])


def test_the_quality_of_an_inverted_element_is_negative():
    corners = np.vstack([np.zeros(3), np.eye(3)])
    assert element_quality(corners, np.array([[0, 1, 2, 3]]))[0] > 50
    assert element_quality(corners, np.array([[1, 0, 2, 3]]))[0] < -50
