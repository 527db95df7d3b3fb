"""Orientation signs against Python's integers: near zero, and from the least double to the greatest."""

from fractions import Fraction

import numpy as np
import pytest

from palpate.collision.triangles.predicates import TERMS_2D, TERMS_3D, new_accumulator, orient2d, orient3d

GREATEST, LEAST = np.finfo(float).max, 5e-324


def sign(rows):
    """Compute the sign of the determinant of vectors to the first of the points ``rows``, as fractions."""
    rows = [[Fraction(float(c)) for c in row] for row in rows]
    p, q, *r = [[a - b for a, b in zip(row, rows[0], strict=True)] for row in rows[1:]]
    if not r:
        value = p[0] * q[1] - p[1] * q[0]
    else:
        (r,) = r
        value = sum(p[i] * (q[(i + 1) % 3] * r[(i + 2) % 3] - q[(i + 2) % 3] * r[(i + 1) % 3]) for i in range(3))
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


@pytest.mark.parametrize(
    "kind",
    [
        "random",
        "near a plane",
        "on a line",
        "lattice",
        "lattice of tiny numbers",
        "lattice of huge numbers",
        "of all sizes",
        "extreme",
    ],
)
def test_signs_agree_with_integer_arithmetic(kind):
    rng, sums = np.random.default_rng(1), new_accumulator()
    for points in sets(rng, kind):
        assert orient3d(points, 0, 1, 2, 3, sums) == sign(points)
        for axis in range(3):
            assert orient2d(points, 0, 1, 2, axis, sums) == sign(np.roll(points[:3], -axis - 1, axis=1)[:, :2])
        assert not sums.any()


def test_swapping_two_points_turns_the_sign():
    rng, sums = np.random.default_rng(2), new_accumulator()
    for points in sets(rng, "near a plane"):
        found = orient3d(points, 0, 1, 2, 3, sums)
        assert orient3d(points, 1, 0, 2, 3, sums) == orient3d(points, 0, 1, 3, 2, sums) == -found
        assert orient3d(points, 2, 3, 0, 1, sums) == found


def test_one_unit_in_the_last_place_is_seen():
    """The sum of 0.1 and 0.2 is not 0.3 in doubles, so that point is above the line."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.3, 0.1 + 0.2, 0.0]])
    assert orient2d(points, 0, 1, 2, 2, new_accumulator()) == 1


def test_products_are_those_of_determinants():
    """The tables' products sum to the determinants, with integers from 1 on that make each product different."""
    points = np.array([[2, 7, 11], [3, 19, 5], [23, 29, 13], [31, 17, 37]])
    volume = sum(s * points[i, 0] * points[j, 1] * points[k, 2] for s, i, j, k in TERMS_3D)
    assert volume == round(np.linalg.det(points[1:] - points[0]))
    area = sum(s * points[i, 0] * points[j, 1] for s, i, j in TERMS_2D)
    assert area == round(np.linalg.det((points[1:3] - points[0])[:, :2]))
