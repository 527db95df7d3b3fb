"""Orientation signs against Python's integers: near zero, and from the least double to the greatest."""

import runpy
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from palpate.collision.triangles.intersection import crossing_segments, triangle_pairs_intersect
from palpate.collision.triangles.predicates import new_accumulator, orient2d, orient3d
from palpate.errors import InputError

GREATEST, LEAST = np.finfo(float).max, 5e-324
KINDS = ("random", "near a plane", "on a line", "lattice", "of all sizes", "extreme")
KINDS += ("lattice of tiny numbers", "lattice of huge numbers")


def sign(rows):
    """Compute the sign of the determinant of vectors to the first of the points ``rows``, as fractions."""
    rows = np.array([[Fraction(float(c)) for c in row] for row in rows])
    p, q, *r = rows[1:] - rows[0]
    value = np.cross(p, q) @ r[0] if r else p[0] * q[1] - p[1] * q[0]
    return (value > 0) - (value < 0)


def sets(rng, kind, n=300):
    points = rng.normal(size=(n, 4, 3))
    if kind == "near a plane":
        weights = rng.dirichlet(np.ones(3), n)
        points[:, 3] = np.einsum("nk,nkc->nc", weights, points[:, :3])
    if kind == "on a line":
        points[:, 2:] = points[:, :1] + rng.integers(-4, 5, (n, 2, 1)) * (points[:, 1] - points[:, 0])[:, None]
    if kind == "lattice":
        points = rng.integers(-2, 3, points.shape).astype(float)
    if kind == "lattice of tiny numbers":
        points = rng.integers(-3, 4, points.shape) * LEAST
    if kind == "lattice of huge numbers":
        points = rng.integers(-3, 4, points.shape) * (GREATEST / 4)
    if kind == "of all sizes":
        points *= 10.0 ** rng.integers(-300, 300, points.shape)
        points[rng.random(points.shape) < 0.3] = 0.0
    if kind == "extreme":
        points = rng.choice([0.0, LEAST, -LEAST, 1.0, -1.0, GREATEST, -GREATEST], points.shape)
    return points


@pytest.mark.parametrize("kind", KINDS)
def test_signs_agree_with_integer_arithmetic(kind):
    rng, sums = np.random.default_rng(1), new_accumulator()
    for points in sets(rng, kind):
        assert orient3d(points, 0, 1, 2, 3, sums) == sign(points)
        for axis in range(3):
            assert orient2d(points, 0, 1, 2, axis, sums) == sign(np.roll(points[:3], -axis - 1, axis=1)[:, :2])
        assert not sums.any()


def test_one_unit_in_the_last_place_is_seen():
    """The sum of 0.1 and 0.2 is not 0.3 in doubles, so that point is above the line."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.3, 0.1 + 0.2, 0.0]])
    assert orient2d(points, 0, 1, 2, 2, new_accumulator()) == 1


EXACT = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks/exact_pairs.py"))
FLAT = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])


@pytest.mark.parametrize("kind", EXACT["SHARES"], ids=lambda kind: kind.__name__)
def test_every_order_agrees_with_integer_arithmetic(kind):
    wrong, hits = EXACT["compare"](kind, 700, np.random.default_rng(11))
    assert wrong == 0
    assert hits > 0


def test_no_pairs_are_no_answers():
    none = np.empty((0, 3, 3))
    assert triangle_pairs_intersect(none, none).shape == (0,)


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        (np.zeros((3, 3)), np.zeros((3, 3)), r"give \(n, 3, 3\)"),
        (np.zeros((2, 3, 3)), np.zeros((3, 3, 3)), "are not pairs"),
        (np.zeros((1, 3, 3)), "text", "Triangles b are not numbers"),
        (np.full((1, 3, 3), "1.0"), np.zeros((1, 3, 3)), "Triangles a are not numbers"),
        (np.zeros((2, 3, 3)), np.full((2, 3, 3), np.nan), "Triangle 0 of b has a coordinate that is not finite"),
        (np.array([FLAT, np.full((3, 3), np.inf)]), np.zeros((2, 3, 3)), "Triangle 1 of a"),
    ],
)
def test_bad_triangles_are_named(a, b, words):
    with pytest.raises(InputError, match=words):
        triangle_pairs_intersect(a, b)


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


def test_by_hand_of_crossing_segments():
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
