"""A cut is where its two functions say, and severs the segments that cross it there."""

from itertools import pairwise

import numpy as np
import pytest

from palpate.bodies.cutting.cut import Blade, Disc, make_cut
from palpate.bodies.cutting.settings import CutSettings, DiscSettings, PlaneSettings
from palpate.bodies.simple_shapes import box
from palpate.errors import InputError

DOWN = np.array([0.0, 0.0, -1.0])
STRAIGHT = np.array([[0.02, 0.05, 0.04], [0.06, 0.05, 0.04]])
BENT = np.array([[0.02, 0.05, 0.04], [0.05, 0.05, 0.04], [0.06, 0.08, 0.04]])


def segments(count=2000, seed=3):
    ends = np.random.default_rng(seed).uniform([0.0, 0.0, 0.0], [0.1, 0.1, 0.05], (2, count, 3))
    return ends[0], ends[0] + 0.3 * (ends[1] - ends[0])


def is_severed(cut, first, last, count=500):
    """By small steps: somewhere along the segment, ``across`` changes its sign inside the patch."""
    share = np.linspace(0.0, 1.0, count)
    found = []
    for a, b in zip(first, last, strict=True):
        way = a + share[:, None] * (b - a)
        changes = np.diff(np.sign(cut.across(way))) != 0.0
        found.append((changes & (cut.within(way)[1:] > 0.0)).any())
    return np.array(found)


@pytest.mark.parametrize(
    "cut",
    [
        Blade(STRAIGHT, DOWN, 0.02),
        Blade(BENT, DOWN, 0.02),
        Blade(BENT, DOWN, 0.02, reached_m=0.04),
        Blade(STRAIGHT, DOWN, 0.02, (True, False)),
        Disc(np.array([0.05, 0.05, 0.03]), np.array([0.6, 0.0, 0.8]), 0.03),
    ],
)
def test_segments_are_severed_where_they_cross_the_patch(cut):
    first, last = segments()
    severed = cut.severs(first, last)
    stepped = is_severed(cut, first, last)
    assert 20 < severed.sum() < 1000
    assert (severed != stepped).sum() <= 2  # steps may jump over the front
    assert np.array_equal(severed, cut.severs(last, first))


def test_of_two_segments_that_meet_on_a_cut_one_is_severed():
    cut, on, step = Blade(STRAIGHT, DOWN, 0.02), np.array([[0.04, 0.05, 0.03]]), np.array([[0.0, 0.01, 0.0]])
    for one, other in ((on + step, on - step), (on - step, on + step)):
        assert cut.severs(one, on) != cut.severs(on, other)


@pytest.mark.parametrize("open_ends", [(False, False), (True, False), (True, True)])
def test_points_of_the_front_are_on_both_levels(open_ends):
    for path in (STRAIGHT, BENT):
        cut = Blade(path, DOWN, 0.015, open_ends)
        front, patch = cut.front(0.001), cut.patch(0.001)
        assert np.abs(cut.across(front)).max() < 1e-12
        assert np.abs(cut.within(front)).max() < 1e-12
        assert np.linalg.norm(np.diff(front, axis=0), axis=1).max() < 1.6e-3
        assert cut.within(patch).min() > -1e-9
        assert np.isclose(patch[:, 2].min(), 0.025)


def test_a_blade_cuts_half_an_ellipse_that_grows_as_it_moves():
    cut = Blade(STRAIGHT, DOWN, 0.015)
    grid = np.stack(np.meshgrid(np.linspace(0.01, 0.07, 601), [0.05], np.linspace(0.02, 0.04, 201)), -1).reshape(-1, 3)
    cell = 0.06 / 600 * 0.02 / 200
    area = np.pi / 4.0 * 0.04 * 0.015
    assert (cut.within(grid) > 0.0).sum() * cell == pytest.approx(area, rel=5e-3)
    assert (cut.up_to(0.02).within(grid) > 0.0).sum() * cell == pytest.approx(area / 2.0, rel=5e-3)
    near = np.abs(cut.within(grid)) < 1e-3
    away = np.linalg.norm(grid[near][:, None] - cut.front(5e-4), axis=2).min(axis=1)
    below = grid[near][:, 2] < 0.0399
    assert np.abs(np.abs(cut.within(grid[near])) - away)[below].max() < 4e-4


def test_across_tells_the_sides_of_a_bent_path_apart():
    cut = Blade(BENT, DOWN, 0.02)
    points = segments()[0]
    flat = np.array([*BENT[:, :2]])
    flat[0] -= [1.0, 0.0]
    flat[-1] += 10.0 * (flat[2] - flat[1])
    distance = np.full(len(points), np.inf)
    for a, b in pairwise(flat):
        share = np.clip((points[:, :2] - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        distance = np.minimum(distance, np.linalg.norm(points[:, :2] - a - share[:, None] * (b - a), axis=1))
    assert np.allclose(np.abs(cut.across(points)), distance, atol=1e-12)
    above = (points[:, 1] > 0.05) & ((points[:, 1] - 0.05) > 3.0 * (points[:, 0] - 0.05))
    assert (cut.across(points[above]) > 0.0).all() or (cut.across(points[above]) < 0.0).all()
    assert np.sign(cut.across(points[above])[0]) != np.sign(cut.across(points[~above])).mean().round()


def plane(point_m, normal):
    return CutSettings(plane=PlaneSettings(point_m=point_m, normal=normal))


def disc(x, y, z, radius_m=0.01):
    return CutSettings(disc=DiscSettings(center_m=[x, y, z], normal=[0, 0, 1], radius_m=radius_m))


def test_settings_become_a_cut_of_the_body():
    mesh = box([0.1, 0.1, 0.04], [4, 4, 2])
    blade = make_cut("cut", CutSettings(path_m=STRAIGHT.tolist(), depth_m=0.01), mesh)
    assert np.allclose(blade.direction, DOWN, atol=1e-12)
    assert blade.open_ends == (False, False)
    through = make_cut("cut", CutSettings(path_m=[[0.0, 0.05, 0.04], [0.05, 0.05, 0.04]], depth_m=0.01), mesh)
    assert through.open_ends == (True, False)
    whole = make_cut("cut", plane([0.05, 0.05, 0.0], [2.0, 0.0, 0.0]), mesh)
    assert np.allclose(whole.across(mesh.nodes), mesh.nodes[:, 0] - 0.05)
    assert (whole.within(mesh.nodes) > 0.0).all()
    assert make_cut("cut", disc(0.05, 0.05, 0.02), mesh).within(np.array([[0.05, 0.05, 0.0]]))[0] == pytest.approx(0.01)
    assert make_cut("cut", disc(0.051, 0.043, 0.013, 1e-5), mesh).pieces  # within an element


@pytest.mark.parametrize(
    "asked",
    [
        CutSettings(),
        plane([0, 0, 0], [0, 0, 1]).but(path_m=STRAIGHT.tolist(), depth_m=0.01),
        CutSettings(path_m=STRAIGHT.tolist()),
        CutSettings(path_m=STRAIGHT[:1].tolist(), depth_m=0.01),
        CutSettings(path_m=[[0.02, 0.05, 0.04], [0.02, 0.05, 0.0]], depth_m=0.01, direction=[0, 0, 1]),
        CutSettings(path_m=STRAIGHT.tolist(), depth_m=0.01, direction=[0, 0, 0]),
        plane([0, 0, 0], [0, 0, 0]),
        plane([0.11, 0, 0], [1, 0, 0]),
        disc(0.05, 0.05, 0.06),
        CutSettings(path_m=[[0.02, 0.12, 0.04], [0.06, 0.12, 0.04]], depth_m=0.01, direction=[0, 0, -1]),
    ],
)
def test_what_is_no_cut_is_refused(asked):
    with pytest.raises(InputError):
        make_cut("cut", asked, box([0.1, 0.1, 0.04], [4, 4, 2]))
