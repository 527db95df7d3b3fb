"""Depths by translating one triangle out, confirmed by the exact test."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from palpate.collision.triangles.distance import triangle_pairs_depth, triangle_pairs_distance
from palpate.collision.triangles.intersection import triangle_pairs_intersect

EXACT = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks/exact_pairs.py"))


def moved(a, signed, direction, part):
    return a - (part * signed)[:, None, None] * direction[:, None]


def test_the_translation_suffices_and_no_shorter_one_does():
    a, b = np.random.default_rng(12).normal(size=(2, 4000, 3, 3))
    signed, direction = triangle_pairs_depth(a, b)
    meets = triangle_pairs_intersect(a, b)
    assert (signed[meets] < 0).all()
    assert not triangle_pairs_intersect(moved(a, signed, direction, 1 + 1e-9), b)[meets].any()
    for part in (0.0, 0.5, 1 - 1e-9):
        assert triangle_pairs_intersect(moved(a, signed, direction, part), b)[meets].all()


def test_no_translation_along_any_normal_is_shorter():
    """A translation by nine tenths of the depth, up or down either face's normal, does not separate them."""
    a, b = np.random.default_rng(13).normal(size=(2, 4000, 3, 3))
    signed, _ = triangle_pairs_depth(a, b)
    meets = triangle_pairs_intersect(a, b)
    for triangles in (a, b):
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        for way in (normal, -normal):
            assert triangle_pairs_intersect(moved(a, signed, way, 0.9), b)[meets].all()


def test_disjoint_it_is_the_distance():
    a, b = np.random.default_rng(14).normal(size=(2, 500, 3, 3))
    signed, direction = triangle_pairs_depth(a, b)
    distance, on_a, on_b = triangle_pairs_distance(a, b)
    apart = ~triangle_pairs_intersect(a, b)
    assert np.array_equal(signed[apart], distance[apart])
    np.testing.assert_allclose((distance[:, None] * direction)[apart], (on_a - on_b)[apart], atol=1e-14)


def test_by_hand():
    """An upright triangle whose tip is 1 mm below a flat one, and some that only touch it."""
    flat = np.array([[0.0, 0, 0], [40, 0, 0], [0, 40, 0]])
    tip = np.array([[10.0, 10, -1], [9, 10, 20], [11, 10, 20]])
    segment = np.array([[10.0, 10, -1], [10, 10, 20], [10, 10, 20]])
    lying, touching = flat + np.array([1, 1, 0]), tip + np.array([0, 0, 1])
    signed, direction = triangle_pairs_depth([flat, tip, flat, flat, flat], [tip, flat, segment, lying, touching])
    np.testing.assert_allclose(signed, [-1, -1, -1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(direction[:, 2], [-1, 1, -1, direction[3, 2], -1], atol=1e-15)
    assert abs(direction[3, 2]) == 1


def test_crossing_segments_have_no_depth_but_a_direction():
    a = np.array([[0.0, 0, 0], [2, 0, 0], [2, 0, 0]])
    b = np.array([[1.0, -1, 0], [1, 1, 0], [1, 1, 0]])
    signed, direction = triangle_pairs_depth([a, a, a[[0, 0, 0]]], [b, a, a])
    assert np.array_equal(signed, [0, 0, 0])
    assert abs(direction[0, 2]) == 1
    np.testing.assert_allclose(direction[1:, 0], 0.0)


@pytest.mark.parametrize("kind", EXACT["SHARES"], ids=lambda kind: kind.__name__)
def test_degenerate_pairs_have_a_sign_and_a_unit_vector(kind):
    pairs = kind(np.random.default_rng(15), 500)
    a, b = pairs[:, :3], pairs[:, 3:]
    signed, direction = triangle_pairs_depth(a, b)
    meets = triangle_pairs_intersect(a, b)
    assert np.isfinite(signed).all()
    assert (signed[meets] <= 0).all()
    assert (signed[~meets] >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1.0, rtol=1e-12)
