"""Segments in common against the triangles they lie on, and the exact test."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from palpate.collision.triangles.intersection import crossing_segments, triangle_pairs_intersect

EXACT = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks/exact_pairs.py"))


def weights(triangles, points):
    """Compute barycentric coordinates (n, 3) of points (n, 3) in triangles (n, 3, 3), and heights over the planes."""
    p, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(u, v)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    s, t, h = np.linalg.solve(np.stack([u, v, normal], axis=2), (points - p)[:, :, None])[:, :, 0].T
    return np.column_stack([1 - s - t, s, t]), h


@pytest.mark.parametrize("scale", [1.0, 2.0**-1000, 2.0**990])
def test_ends_lie_on_both_triangles_and_on_an_edge_of_one(scale):
    a, b = np.random.default_rng(4).normal(size=(2, 3000, 3, 3))
    hit, ends = crossing_segments(a * scale, b * scale)
    assert np.array_equal(hit, triangle_pairs_intersect(a, b))
    a, b, ends = a[hit], b[hit], ends[hit] / scale
    for end in (0, 1):
        in_a, above_a = weights(a, ends[:, end])
        in_b, above_b = weights(b, ends[:, end])
        assert max(np.abs(above_a).max(), np.abs(above_b).max()) < 1e-13
        # both ends of the common segment: inside both triangles, and on the boundary of one
        np.testing.assert_allclose(np.minimum(in_a.min(axis=1), in_b.min(axis=1)), 0.0, atol=1e-12)
    middle = ends.mean(axis=1)
    assert (weights(a, middle)[0] > 0).all()
    assert (weights(b, middle)[0] > 0).all()


def test_by_hand():
    flat = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])
    others = np.array(
        [
            [[1, 1, -1], [1, 1, 1], [9, 1, 0]],
            [[1, 1, 0], [2, 2, 1], [1, 2, 1]],
            [[1, 0, 0], [2, 0, 0], [1, 0, 1]],
            [[1, 1, -1], [1, 1, 1], [1, 1, 1]],
            [[1, 1, 0], [2, 1, 0], [1, 2, 0]],
            [[1, 1, 1], [2, 1, 1], [1, 2, 1]],
        ],
        dtype=float,
    )
    hit, ends = crossing_segments(np.repeat(flat[None], len(others), axis=0), others)
    assert hit.tolist() == [True, True, True, True, False, False]
    expected = [[[1, 1, 0], [3, 1, 0]], [[1, 1, 0]] * 2, [[1, 0, 0], [2, 0, 0]], [[1, 1, 0]] * 2]
    found = np.sort(ends, axis=1)
    assert np.array_equal(found[:4], expected)
    assert not found[4:].any()


@pytest.mark.parametrize("kind", EXACT["SHARES"], ids=lambda kind: kind.__name__)
def test_degenerate_pairs_have_finite_ends_within_both_boxes(kind):
    pairs = kind(np.random.default_rng(6), 500)
    a, b = pairs[:, :3], pairs[:, 3:]
    hit, ends = crossing_segments(a, b)
    assert not (hit & ~triangle_pairs_intersect(a, b)).any()
    assert np.isfinite(ends).all()
    a, b, ends = a[hit], b[hit], ends[hit]
    low = np.minimum(a.min(axis=1), b.min(axis=1))[:, None]
    high = np.maximum(a.max(axis=1), b.max(axis=1))[:, None]
    lost = 1e-320 * np.maximum(np.abs(low), np.abs(high)).max(axis=2, keepdims=True)
    assert ((low - lost <= ends) & (ends <= high + lost)).all()
