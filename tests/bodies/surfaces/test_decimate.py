"""Collapses that keep what a surface is."""

import numpy as np
import pytest

from palpate.bodies.mesh_quality import check_closed
from palpate.bodies.surfaces.decimate import collapse, fibonacci_sphere, remesh, triangulate
from palpate.bodies.surfaces.triangles import vertex_normals, volume


@pytest.fixture
def ball():
    points = fibonacci_sphere(2000)
    return points, triangulate(points)


def test_collapses_to_any_count_that_a_closed_surface_can_have(ball):
    points, triangles = collapse(*ball, 20)
    assert (len(points), len(triangles)) == (20, 36)
    check_closed("ball", points, triangles)
    points, triangles = collapse(*ball, 3)
    check_closed("ball", points, triangles)
    assert np.bincount(triangles.ravel()).min() >= 4


def test_a_needle_of_no_area_is_collapsed(ball):
    points, triangles = ball
    points[triangles[0, 1]] = points[triangles[0, 0]]
    points, triangles = collapse(points, triangles, 1000)
    lengths = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, axis=1)], axis=2)
    assert lengths.min() > 0.2 * lengths.mean()


def test_vertices_end_on_the_dense_surface_and_evenly(ball):
    points, triangles = remesh(*collapse(*ball, 600), *ball, 100)
    check_closed("ball", points, triangles)
    assert np.abs(np.linalg.norm(points, axis=1) - 1).max() < 0.005
    assert volume(points, triangles) > 0.93 * 4 / 3 * np.pi
    lengths = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, axis=1)], axis=2)
    assert lengths.std() < 0.2 * lengths.mean()
    assert (np.einsum("ij,ij->i", vertex_normals(points, triangles), points) > 0.97).all()
