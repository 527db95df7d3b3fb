"""Stencils from pairs of triangles against all points, edges and triangles."""

from itertools import combinations, product

import numpy as np
import pytest

from palpate.collision.contact.barrier import Surface, adjacent_pairs, stencils
from palpate.collision.triangles.closest_points import EDGE_EDGE, POINT_TRIANGLE, closest_points
from palpate.errors import InputError


def sheet(count, first=0):
    """Triangulate a square of count × count nodes."""
    corner = first + (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    return np.vstack(
        [
            np.column_stack([corner, corner + 1, corner + count]),
            np.column_stack([corner + 1, corner + count + 1, corner + count]),
        ]
    )


def folded(count, rng):
    """Make nodes of a crumpled sheet that comes near itself."""
    u, v = np.meshgrid(*2 * [np.linspace(0.0, 1.0, count)], indexing="ij")
    points = np.stack([0.3 * np.cos(5.0 * u), v, 0.3 * np.sin(5.0 * u) * (1.0 + 0.1 * u)], axis=-1).reshape(-1, 3)
    return points + 0.02 * rng.normal(size=points.shape)


def key(kind, nodes):
    """Name a stencil uniquely, whatever the order of its nodes."""
    if kind == POINT_TRIANGLE:
        return kind, int(nodes[0]), tuple(sorted(set(map(int, nodes[1:]))))
    return kind, *sorted([tuple(sorted(map(int, nodes[:2]))), tuple(sorted(map(int, nodes[2:])))])


def is_point(triangle):
    return len(set(map(int, triangle))) == 1


def parts(triangles):
    """List vertices, edges (pairs of different nodes), and triangles as sets."""
    corners = {int(p) for t in triangles for p in t}
    edges = {tuple(sorted((int(t[i]), int(t[i - 1])))) for t in triangles for i in range(3) if t[i] != t[i - 1]}
    return corners, edges


def brute_force(first, second, points, within):
    """Name all stencils of two sets of triangles nearer than ``within``; of one with itself where they are equal."""
    found = set()
    same = first is second
    sides = [(first, second)] if same else [(first, second), (second, first)]
    for side, (mine, other) in enumerate(sides):
        alone = {int(t[0]) for t in mine if is_point(t)}
        for p, triangle in product(parts(mine)[0], other):
            if p not in triangle and (not is_point(triangle) or (p in alone and side == 0)):
                found.add((POINT_TRIANGLE, (p, *map(int, triangle))))
    edges = combinations(parts(first)[1], 2) if same else product(parts(first)[1], parts(second)[1])
    found |= {(EDGE_EDGE, (*e, *f)) for e, f in edges if not set(e) & set(f)}
    kinds, nodes = np.array([k for k, _ in found]), np.array([n for _, n in found])
    close = closest_points(kinds, nodes, points)[0] < within
    return {key(k, n) for k, n in zip(kinds[close], nodes[close], strict=True)}


def triangle_pairs(first, second, points, within):
    """List pairs of triangles whose boxes are that near, as a tree does; in one set i < j without a common node."""
    low = [points[t].min(axis=1) for t in (first, second)]
    high = [points[t].max(axis=1) for t in (first, second)]
    apart = np.maximum(low[0][:, None] - high[1], low[1] - high[0][:, None]).max(axis=2)
    pairs = np.argwhere(apart <= within)
    if first is second:
        common = (first[pairs[:, 0], :, None] == second[pairs[:, 1], None, :]).any(axis=(1, 2))
        pairs = pairs[(pairs[:, 0] < pairs[:, 1]) & ~common]
    return pairs


def names(kinds, nodes, points, within):
    close = closest_points(kinds, nodes, points)[0] < within
    found = [key(k, n) for k, n in zip(kinds[close], nodes[close], strict=True)]
    assert len(set(found)) == len(found)
    return set(found)


@pytest.mark.parametrize("seed", range(4))
def test_two_surfaces(seed):
    rng = np.random.default_rng(seed)
    points = np.vstack([folded(7, rng), folded(7, rng) + 0.05])
    first, second = sheet(7), sheet(7, 49)
    pairs = triangle_pairs(first, second, points, 0.05)
    found = names(*stencils(Surface(first), Surface(second), pairs), points, 0.05)
    assert found == brute_force(first, second, points, 0.05)
    assert len(found) > 50


@pytest.mark.parametrize("seed", range(4))
def test_one_surface_with_itself_needs_adjacent_pairs_too(seed):
    points, triangles = folded(8, np.random.default_rng(seed)), sheet(8)
    surface = Surface(triangles)
    pairs = triangle_pairs(triangles, triangles, points, 0.12)
    found = names(*stencils(surface, surface, np.vstack([pairs, adjacent_pairs(triangles)])), points, 0.12)
    expected = brute_force(triangles, triangles, points, 0.12)
    assert found == expected
    assert names(*stencils(surface, surface, pairs), points, 0.12) < expected


def test_spheres_capsules_and_a_surface():
    rng = np.random.default_rng(7)
    points = np.vstack([folded(6, rng), rng.uniform(-0.3, 0.6, size=(5, 3))])
    first, second = sheet(6), np.array([[36, 36, 36], [37, 38, 38], [39, 39, 39], [40, 37, 37]])
    for mine, other in ((first, second), (second, first), (second, second.copy()[::-1])):
        pairs = np.array(list(product(range(len(mine)), range(len(other)))))
        if np.array_equal(np.unique(mine), np.unique(other)):
            continue
        found = names(*stencils(Surface(mine), Surface(other), pairs), points, 0.4)
        assert found == brute_force(mine, other, points, 0.4)


def test_two_points_pair_once_and_two_segments_with_ends_and_edges():
    one = stencils(Surface(np.array([[0, 0, 0]])), Surface(np.array([[1, 1, 1]])), np.array([[0, 0]]))
    assert one[0].tolist() == [POINT_TRIANGLE] and one[1].tolist() == [[0, 1, 1, 1]]
    kinds, nodes = stencils(Surface(np.array([[0, 1, 1]])), Surface(np.array([[2, 3, 3]])), np.array([[0, 0]]))
    assert kinds.tolist() == [0, 0, 0, 0, 1]
    assert nodes.tolist() == [[0, 2, 3, 3], [1, 2, 3, 3], [2, 0, 1, 1], [3, 0, 1, 1], [0, 1, 2, 3]]


@pytest.mark.parametrize("triangle", [(0, 1, 1), (1, 0, 1), (1, 1, 0)])
def test_a_segment_has_one_edge_wherever_it_repeats_a_node(triangle):
    surface = Surface(np.array([triangle]))
    assert surface.vertices.sum() == 2 and surface.edges.sum() == 1


def test_every_vertex_and_edge_is_owned_once():
    triangles = sheet(9)
    surface = Surface(triangles)
    assert surface.vertices.sum() == 81
    assert surface.edges.sum() == len(parts(triangles)[1])
    assert np.array_equal(np.sort(triangles[surface.vertices]), np.arange(81))


def test_adjacent_pairs_are_all_that_share_a_node():
    triangles = np.vstack([sheet(5), [[30, 31, 31], [31, 31, 31], [40, 40, 40]]])
    shared = (triangles[:, None, :, None] == triangles[None, :, None, :]).any(axis=(2, 3))
    assert np.array_equal(adjacent_pairs(triangles), np.argwhere(np.triu(shared, 1)))
    assert adjacent_pairs(np.empty((0, 3), int)).shape == (0, 2)


def test_empty_and_bad_surfaces():
    empty = Surface(np.empty((0, 3), int))
    kinds, nodes = stencils(empty, empty, np.empty((0, 2), int))
    assert kinds.shape == (0,) and nodes.shape == (0, 4)
    for triangles in (np.zeros((2, 4), int), np.zeros((2, 3)), np.array([[0, 1, -1]])):
        with pytest.raises(InputError):
            Surface(triangles)
