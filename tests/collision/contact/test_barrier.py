"""The barrier's force and Hessian against finite differences, in every region and near every degenerate shape."""

import numpy as np
import pytest

from palpate.collision.contact import barrier
from palpate.collision.contact.barrier import thresholds
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
