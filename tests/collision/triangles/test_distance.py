"""Closest points of triangles by their separating planes, which no closer pair of points could satisfy."""

import runpy
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from palpate.collision.triangles.closest_points import EDGE_EDGE, POINT_TRIANGLE, boxes_apart, closest_points
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
def test_degenerate_pairs_have_a_distance_and_places(kind):
    pairs = kind(np.random.default_rng(15), 500)
    a, b = pairs[:, :3], pairs[:, 3:]
    distance, on_a, on_b = triangle_pairs_distance(a, b)
    assert np.isfinite([on_a, on_b]).all() and np.isfinite(distance).all() and (distance >= 0.0).all()
    assert (distance[triangle_pairs_intersect(a, b)] == 0.0).all()


NODES = np.arange(4)


def exact_square(kind, x):
    """Compute d² as a fraction: the least over all corners, and all lines and planes whose minimum lies inside."""
    x = np.array([[Fraction(float(c)) for c in row] for row in x])
    if kind == POINT_TRIANGLE:
        r, e, f = x[1] - x[0], x[2] - x[1], x[3] - x[1]
        corners = [(Fraction(0), Fraction(0)), (Fraction(1), Fraction(0)), (Fraction(0), Fraction(1))]
    else:
        r, e, f = x[0] - x[2], x[1] - x[0], x[2] - x[3]
        corners = [(Fraction(s), Fraction(t)) for s, t in ((0, 0), (1, 0), (1, 1), (0, 1))]
    ends = [r + s * e + t * f for s, t in corners]
    points = [*ends]
    for start, way in zip(ends, np.roll(ends, -1, axis=0) - ends, strict=True):
        if way @ way > 0 and 0 < (part := -(start @ way) / (way @ way)) < 1:
            points.append(start + part * way)
    if (det := (e @ e) * (f @ f) - (e @ f) ** 2) > 0:
        s, t = ((e @ f) * (f @ r) - (f @ f) * (e @ r)) / det, ((e @ f) * (e @ r) - (e @ e) * (f @ r)) / det
        if min(s, t) > 0 and (s + t < 1 if kind == POINT_TRIANGLE else max(s, t) < 1):
            points.append(r + s * e + t * f)
    return min(point @ point for point in points)


def shapes(rng, count):
    """Make stencils (k, 4, 3): general ones, needles, flat, collapsed, parallel, crossing, coincident, tiny."""
    x = rng.normal(size=(10, count, 4, 3))
    small = 10.0 ** rng.uniform(-17, -1, size=(10, count, 1))
    way = x[:, :, 1] - x[:, :, 0]
    x[1, :, 3] = x[1, :, 2] + small[1] * rng.normal(size=(count, 3))  # a needle, an edge of hardly any length
    x[2, :, 3] = x[2, :, 2] + way[2] * rng.normal(size=(count, 1)) + small[2] * rng.normal(size=(count, 3))  # parallel
    x[3, :, 3] = x[3, :, 1] + rng.normal(size=(count, 1)) * (x[3, :, 2] - x[3, :, 1])  # corners on one line
    x[4, :, 2:] = x[4, :, 1:2]  # a point
    x[5, :, 3] = x[5, :, 2]  # a segment
    weights = rng.dirichlet(np.ones(3), size=count)[:, :, None]
    x[6, :, 0] = np.sum(weights * x[6, :, 1:], axis=1) + small[6] * rng.normal(size=(count, 3))  # close to touching
    x[7] = rng.integers(0, 3, size=(count, 4, 3))  # on a lattice: coincident, parallel, coplanar
    s, t = rng.uniform(-0.2, 1.2, size=(2, count, 1))
    x[8, :, 3] = x[8, :, 2] + (x[8, :, 0] + s * way[8] - x[8, :, 2]) / t  # two edges whose lines cross
    x[9, :, 2:] *= small[9][:, None]  # an edge as near to another as it is long
    x[9, :, 2:] += (x[9, :, 0] + rng.uniform(size=(count, 1)) * way[9])[:, None]
    return x.reshape(-1, 4, 3)


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
@pytest.mark.parametrize("away", [0.0, 100.0])
def test_distance_is_the_least_to_rounding(kind, away):
    free = set()
    for x in shapes(np.random.default_rng(1), 60) + away:
        distance, weights, normals = closest_points(np.array([kind]), NODES[None], x)
        exact, size = float(exact_square(kind, x)) ** 0.5, np.ptp(x, axis=0).max()
        assert abs(distance[0] - exact) <= 16 * np.finfo(float).eps * size
        assert np.linalg.norm(distance[0] * normals[0] - weights[0] @ (x - x[0])) <= 1e-15 * size
        ends = kind + 1
        assert weights[0, :ends].min() >= 0.0 and weights[0, ends:].max() <= 0.0
        assert abs(weights[0, :ends].sum() - 1.0) < 1e-15 and abs(weights[0, ends:].sum() + 1.0) < 1e-15
        free.add(np.count_nonzero(weights[0]) - 2)
    assert free == {0, 1, 2}


def test_closest_point_is_exact_to_rounding_although_the_distance_is_flat_there():
    """Points above a side, 1e-9 to either side of where a corner, the face or another side becomes the closest."""
    rng = np.random.default_rng(2)
    for x in rng.normal(size=(300, 4, 3)):
        side, normal = x[2] - x[1], np.cross(x[2] - x[1], x[3] - x[1])
        side, normal = side / np.linalg.norm(side), normal / np.linalg.norm(normal)
        inward, along, across = np.cross(normal, side), *(1e-9 * rng.normal(size=2))
        x[0] = x[1] + along * side + across * inward + normal  # the distance changes by 1e-18 at most
        _, weights, _ = closest_points(np.zeros(1, int), NODES[None], x)
        r = weights[0] @ x
        assert r @ r - min(r @ (x[0] - corner) for corner in x[1:]) < 1e-14 * np.ptp(x)


def test_touching_parts_have_no_normal():
    x = np.array([[0.25, 0.25, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    distance, _, normals = closest_points(np.zeros(1, int), NODES[None], x)
    assert distance[0] == 0.0 and not normals.any()


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_boxes_exclude_some_far_stencils_and_no_near_ones(kind):
    excluded = 0
    for x in np.random.default_rng(6).normal(size=(300, 4, 3)):
        distance = closest_points(np.array([kind]), NODES[None], x)[0][0]
        excluded += boxes_apart(kind, x, NODES, 0.5 * distance)
        assert not boxes_apart(kind, x, NODES, distance)
    assert excluded > 100
