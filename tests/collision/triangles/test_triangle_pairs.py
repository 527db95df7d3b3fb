"""Triangle pairs against another method in integers, in every order, and by hand."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from palpate.collision.triangles.intersection import pairs_intersect, triangle_pairs_intersect
from palpate.errors import InputError

EXACT = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks/exact_pairs.py"))
FLAT = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])


@pytest.mark.parametrize("kind", EXACT["SHARES"], ids=lambda kind: kind.__name__)
def test_every_order_agrees_with_integer_arithmetic(kind):
    wrong, hits = EXACT["compare"](kind, 700, np.random.default_rng(11))
    assert wrong == 0
    assert hits > 0


@pytest.mark.parametrize(
    ("corners", "intersect"),
    [
        ([[1, 1, -1], [1, 1, 1], [5, 5, 0]], True),
        ([[1, 1, 0], [1, 1, 3], [2, 1, 3]], True),
        ([[1, 1, 1e-300], [1, 1, 3], [2, 1, 3]], False),
        ([[0, 0, 0], [-1, -1, 2], [-1, -2, 2]], True),
        ([[0, 4, 0], [4, 0, 0], [4, 4, 0]], True),
        ([[2, 2, 0], [4, 4, 0], [5, 4, 0]], True),
        ([[2, np.nextafter(2, 3), 0], [4, 4, 0], [5, 4, 0]], False),
        ([[1, 1, 0], [1.5, 1, 0], [1, 1.5, 0]], True),
        ([[5, 0, 0], [9, 0, 0], [5, 4, 0]], False),
        ([[1, 1, 0]] * 3, True),
        ([[2, 2, 0]] * 3, True),
        ([[3, 2, 0]] * 3, False),
        ([[1, 1, -1], [1, 1, 1], [1, 1, 1]], True),
        ([[1, 1, -1], [1, 1, 0], [1, 1, 1]], True),
        ([[-1, 1, -1], [-1, 1, 0], [-1, 1, 1]], False),
        ([[-1, 2, 0], [9, 2, 0], [-1, 2, 0]], True),
        ([[0.5, 0.5, 1e300], [0.5, 0.5, -1e-300], [9e300, 9e300, 1e300]], True),
    ],
)
def test_by_hand(corners, intersect):
    b = np.array(corners, dtype=float)
    assert triangle_pairs_intersect([FLAT], [b]) == [intersect]
    assert triangle_pairs_intersect([b], [FLAT]) == [intersect]


@pytest.mark.parametrize(
    ("a", "b", "intersect"),
    [
        ([(0, 0, 0), (2, 2, 2)], [(0, 2, 1), (2, 0, 1)], True),
        ([(0, 0, 0), (2, 2, 2)], [(0, 2, 1), (2, 0, 2)], False),
        ([(0, 0, 0), (2, 2, 2)], [(1, 1, 1), (3, 3, 3)], True),
        ([(0, 0, 0), (2, 2, 2)], [(3, 3, 3), (4, 4, 4)], False),
        ([(0, 0, 0), (2, 2, 2)], [(0, 0, 1), (2, 2, 3)], False),
        ([(0, 0, 0), (2, 2, 2)], [(1, 1, 1), (1, 1, 1)], True),
        ([(0, 0, 0), (2, 2, 2)], [(1, 1, 2), (1, 1, 2)], False),
        ([(1, 1, 1), (1, 1, 1)], [(1, 1, 1), (1, 1, 1)], True),
        ([(1, 1, 1), (1, 1, 1)], [(1, 1, 2), (1, 1, 2)], False),
    ],
)
def test_segments_and_points(a, b, intersect):
    for p in ([a[0], a[0], a[1]], [a[1], a[0], a[1]]):
        for q in ([b[0], b[1], b[1]], [b[1], b[0], b[0]]):
            assert triangle_pairs_intersect([p], [q]) == [intersect]


def test_indexed_triangles_are_the_same_pairs():
    rng = np.random.default_rng(3)
    points, others = rng.normal(size=(2, 60, 3))
    triangles, faces = rng.integers(0, 60, (40, 3)), rng.integers(0, 60, (50, 3))
    pairs = np.column_stack([rng.integers(0, 40, 500), rng.integers(0, 50, 500)])
    found = pairs_intersect(points, triangles, others, faces, pairs)
    expected = triangle_pairs_intersect(points[triangles[pairs[:, 0]]], others[faces[pairs[:, 1]]])
    assert np.array_equal(found, expected)
    assert 0 < found.sum() < 500


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
