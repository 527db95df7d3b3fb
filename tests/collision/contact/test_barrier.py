"""The barrier's force and Hessian against finite differences, in every region and near every degenerate shape."""

from itertools import combinations, product

import numpy as np
import pytest

from palpate.collision.contact import barrier
from palpate.collision.contact.barrier import Surface, adjacent_pairs, stencils, thresholds
from palpate.collision.triangles.closest_points import EDGE_EDGE, POINT_TRIANGLE, closest_points

NODES = np.arange(4)[None]


def stencil(kind, x, offset=0.0, gap=1.0, rest=None, mollified=True):
    kinds = np.array([kind])
    mollify = thresholds(kinds, NODES, x if rest is None else rest) if mollified else np.zeros(1)
    return kinds, NODES, np.array([offset]), np.array([3.0]), mollify, gap


def force(arguments, x):
    out = np.zeros_like(x)
    barrier.add_force(*arguments, x, out)
    return out


def hessian(arguments, x, definite=False):
    active, blocks = barrier.blocks(*arguments, x, definite)
    assert active.tolist() == [0]
    return blocks[0].transpose(0, 2, 1, 3).reshape(12, 12)


def differences(function, x, step):
    """Compute central differences of fourth order by each coordinate, (12, ...)."""
    out = []
    for i in range(x.size):
        delta = np.zeros(x.size)
        delta[i] = step
        delta = delta.reshape(x.shape)
        near, far = (function(x + k * delta) - function(x - k * delta) for k in (1, 2))
        out.append((8.0 * near - far) / (12.0 * step))
    return np.array(out)


def region(kind, x, reach):
    """Find the nonzero weights, if they are the same wherever a coordinate is moved by ``reach``."""
    found = set()
    for i in range(12):
        for side in (-reach, reach):
            moved = x.copy()
            moved.flat[i] += side
            found.add(tuple(closest_points(np.array([kind]), NODES, moved)[1][0] != 0.0))
    return found.pop() if len(found) == 1 else None


def configurations(kind, count=60):
    """Make stencils 0.1 to 0.9 apart: general, needles, almost parallel; less the sum of radii."""
    rng = np.random.default_rng(kind)
    for x in rng.normal(size=(count, 4, 3)):
        style = rng.integers(4)
        if style == 1:
            x[3] = x[2] + 0.05 * rng.normal(size=3)
        if style == 2:
            x[3] = x[2] + (x[1] - x[0]) + 0.03 * rng.normal(size=3)
        distance, _, normals = closest_points(np.array([kind]), NODES, x)
        x[: kind + 1] += (rng.uniform(0.1, 0.9) - distance) * normals[0]
        yield x, 0.05 * (style == 3)


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
@pytest.mark.parametrize("mollified", [False, True])
def test_force_and_hessian_are_derivatives(kind, mollified):
    regions = set()
    for x, offset in configurations(kind):
        # the threshold of longer edges, so that many stencils are within it
        arguments = stencil(kind, x, offset, rest=6.0 * x, mollified=mollified)
        found = force(arguments, x)
        size = np.abs(found).max()
        slope = differences(lambda y, a=arguments: barrier.energy(*a, y), x, 1e-5)
        assert np.abs(found.ravel() + slope).max() < 1e-7 * max(size, 1.0)
        if (here := region(kind, x, 1e-3)) is None:
            continue  # at a change of region the Hessian has a step
        regions.add(here)
        found, slope = hessian(arguments, x), -differences(lambda y, a=arguments: force(a, y).ravel(), x, 1e-4)
        assert np.abs(found - slope).max() < 1e-5 * np.abs(found).max()
        assert np.abs(found - found.T).max() <= 1e-14 * np.abs(found).max()
    assert {sum(here) - 2 for here in regions} == {0, 1, 2}


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
@pytest.mark.parametrize("mollified", [False, True])
def test_definite_blocks_lack_only_what_is_negative(kind, mollified):
    for x, offset in configurations(kind):
        arguments = stencil(kind, x, offset, rest=6.0 * x, mollified=mollified)
        exact, definite = hessian(arguments, x), hessian(arguments, x, True)
        size = np.abs(definite).max()
        assert np.linalg.eigvalsh(definite).min() > -1e-12 * size
        assert mollified or np.linalg.eigvalsh(definite - exact).min() > -1e-12 * size


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_forces_neither_push_nor_turn_as_a_whole_and_energy_is_frame_free(kind, rotation):
    for x, offset in configurations(kind, 20):
        arguments = stencil(kind, x, offset, rest=6.0 * x)
        found, turn = force(arguments, x), rotation(1.0)
        size = np.abs(found).max() + 1e-3
        assert np.abs(found.sum(axis=0)).max() < 1e-13 * size
        assert np.abs(np.cross(x, found).sum(axis=0)).max() < 1e-12 * size
        assert np.abs(force(arguments, x @ turn.T) - found @ turn.T).max() < 1e-9 * size


def test_force_is_continuous_through_parallel_edges_only_with_the_mollifier():
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 0.0, 0.5], [1.2, 0.0, 0.5]])
    turned = [x + np.array([[0.0] * 3] * 3 + [[0.0, angle, 0.0]]) for angle in (-1e-12, 1e-12)]
    lengthwise = [x + np.array([[0.0] * 3] * 3 + [[0.0, 0.0, angle]]) for angle in (-1e-12, 1e-12)]
    for pair in (turned, lengthwise):
        smooth = [force(stencil(EDGE_EDGE, x), y) for y in pair]
        assert np.abs(smooth[0] - smooth[1]).max() < 1e-8
    rough = [force(stencil(EDGE_EDGE, x, mollified=False), y) for y in lengthwise]
    assert np.abs(rough[0] - rough[1]).max() > 0.1


def test_energy_grows_beyond_bound_and_ends_at_the_gap():
    x = np.array([[0.2, 0.2, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    arguments = stencil(POINT_TRIANGLE, x, offset=0.3, gap=0.01)
    energies = []
    for room in 0.01 * np.logspace(0, -12, 13):
        x[0, 2] = 0.3 + room
        energies.append(barrier.energy(*arguments, x))
    assert abs(energies[0]) < 1e-30 and np.all(np.diff(energies) > 0) and np.isfinite(energies[-1])
    for height in (0.3 - 1e-9, 0.0):
        x[0, 2] = height
        assert barrier.energy(*arguments, x) == np.inf
        assert not force(arguments, x).any()
        assert not len(barrier.blocks(*arguments, x, False)[0])
    x[0, 2] = np.nan
    assert barrier.energy(*arguments, x) == np.inf


@pytest.mark.parametrize("definite", [False, True])
def test_points_and_segments_in_place_of_triangles(definite):
    """A sphere and a capsule: repeated nodes, forces along the line of centres, everything finite."""
    x = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    kinds, nodes = np.zeros(2, int), np.array([[0, 1, 1, 1], [0, 1, 2, 2]])
    arguments = kinds, nodes, np.full(2, 0.3), np.ones(2), np.zeros(2), 0.5
    found = force(arguments, x)
    assert found[0, 2] > 0.0 and not found[:, :2].any()
    assert np.array_equal(found[1], -found[0]) and not found[2].any()
    active, blocks = barrier.blocks(*arguments, x, definite)
    assert active.tolist() == [0, 1] and np.isfinite(blocks).all()


def test_finite_next_to_parallel_collapsed_and_touching():
    rng = np.random.default_rng(4)
    for _ in range(300):
        x = rng.normal(size=(4, 3))
        small = 10.0 ** rng.uniform(-16, -1, size=3)
        x[3] = x[2] + rng.normal() * (x[1] - x[0]) + small[0] * rng.normal(size=3)
        if rng.integers(2):
            x[1] = x[0] + small[1] * rng.normal(size=3)
        for kind in (POINT_TRIANGLE, EDGE_EDGE):
            distance, _, normals = closest_points(np.array([kind]), NODES, x)
            y = x.copy()
            y[: kind + 1] += (small[2] - distance) * normals[0]
            arguments = stencil(kind, y, gap=0.1)
            assert barrier.energy(*arguments, y) > -np.inf
            assert np.isfinite(force(arguments, y)).all()
            for definite in (False, True):
                assert np.isfinite(barrier.blocks(*arguments, y, definite)[1]).all()


def test_thresholds_come_from_edges_at_rest_only():
    rest = np.random.default_rng(5).normal(size=(4, 3))
    first, second = rest[1] - rest[0], rest[3] - rest[2]
    found = thresholds(np.array([0, 1, 1]), np.array([[0, 1, 2, 3], [0, 1, 2, 3], [0, 0, 2, 3]]), rest)
    assert found[0] == found[2] == 0.0
    assert np.isclose(found[1], 1e-3 * (first @ first) * (second @ second), rtol=1e-14)


def sheet(count, first=0):
    """Triangulate a square of count × count nodes."""
    corner = first + (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    lower, upper = ([corner, corner + 1, corner + count], [corner + 1, corner + count + 1, corner + count])
    return np.hstack([lower, upper]).T


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


def test_adjacent_pairs_are_all_that_share_a_node():
    triangles = np.vstack([sheet(5), [[30, 31, 31], [31, 31, 31], [40, 40, 40]]])
    shared = (triangles[:, None, :, None] == triangles[None, :, None, :]).any(axis=(2, 3))
    assert np.array_equal(adjacent_pairs(triangles), np.argwhere(np.triu(shared, 1)))
    assert adjacent_pairs(np.empty((0, 3), int)).shape == (0, 2)


def test_empty_surfaces():
    empty = Surface(np.empty((0, 3), int))
    kinds, nodes = stencils(empty, empty, np.empty((0, 2), int))
    assert kinds.shape == (0,) and nodes.shape == (0, 4)
