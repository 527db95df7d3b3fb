"""Closest points of triangles by their separating planes, which no closer pair of points could satisfy."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from palpate.collision.triangles.distance import triangle_pairs_distance
from palpate.collision.triangles.intersection import triangle_pairs_intersect

EXACT = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks/exact_pairs.py"))
ORDINARY = [kind for kind in EXACT["SHARES"] if kind.__name__ not in ("tiny", "huge", "tiny_and_huge")]


@pytest.mark.parametrize("kind", ORDINARY, ids=lambda kind: kind.__name__)
def test_points_are_closest_and_their_distance_is_returned(kind):
    pairs = kind(np.random.default_rng(7), 1500)
    a, b = pairs[:, :3], pairs[:, 3:]
    distance, on_a, on_b = triangle_pairs_distance(a, b)
    meets = triangle_pairs_intersect(a, b)
    size = np.abs(pairs).max(axis=(1, 2))
    assert (distance[meets] == 0.0).all()
    assert np.array_equal(on_a[meets], on_b[meets])
    assert (np.abs(np.linalg.norm(on_a - on_b, axis=1) - distance) <= 1e-15 * size).all()
    # planes across the shortest line at its ends have all of a on one side, and all of b on the other
    clear = distance > 1e-8 * size
    line = (on_a - on_b)[clear] / distance[clear, None]
    between = np.einsum("nijc,nc->nij", a[clear, :, None] - b[clear, None], line).min(axis=(1, 2))
    assert (between >= distance[clear] - 1e-14 * size[clear] ** 2 / distance[clear]).all()


@pytest.mark.parametrize("scale", [2.0**-1000, 2.0**1000])
def test_scale_changes_nothing(scale):
    a, b = np.random.default_rng(8).normal(size=(2, 300, 3, 3))
    for found, expected in zip(
        triangle_pairs_distance(a * scale, b * scale), triangle_pairs_distance(a, b), strict=True
    ):
        assert np.array_equal(found / scale, expected)


@pytest.mark.parametrize("corners", [[0, 0, 0], [0, 0, 1], [0, 1, 2]])
def test_intersecting_triangles_share_the_point_returned(corners):
    """Also a segment through the interior of a triangle, far from its edges and corners, and a point in it."""
    rng = np.random.default_rng(9)
    a, b = rng.normal(size=(2, 2000, 3, 3))
    a = a[:, corners]
    a += (np.einsum("nk,nkc->nc", rng.dirichlet(np.ones(3), 2000), b) - a.mean(axis=1))[:, None]
    distance, on_a, on_b = triangle_pairs_distance(a, b)
    assert distance.max() < 1e-14
    for triangles, points in ((a, on_a), (b, on_b)):
        assert triangle_pairs_distance(np.repeat(points[:, None], 3, axis=1), triangles)[0].max() < 1e-13


@pytest.mark.parametrize("kind", EXACT["SHARES"], ids=lambda kind: kind.__name__)
def test_nothing_is_lost_in_degenerate_pairs(kind):
    pairs = kind(np.random.default_rng(10), 500)
    distance, on_a, on_b = triangle_pairs_distance(pairs[:, :3], pairs[:, 3:])
    assert np.isfinite(distance).all()
    assert np.isfinite(on_a).all()
    assert np.isfinite(on_b).all()
