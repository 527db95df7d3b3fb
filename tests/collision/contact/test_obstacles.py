"""Obstacles: their shapes, their paths, and what is refused."""

import numpy as np
import pytest

from palpate.collision.contact.obstacles import make_obstacle
from palpate.errors import InputError

MIDDLE = np.array([0.3, 0.2, 0.1])
BALL = {"kind": "sphere", "center_m": [1.0, 2.0, 3.0], "radius_m": 0.5}


def made(settings, size=0.1):
    return make_obstacle(settings, "there", "given", size, MIDDLE)


def test_shapes():
    ball = made(BALL)
    assert np.array_equal(ball.points, [[1.0, 2.0, 3.0]]) and np.array_equal(ball.triangles, [[0, 0, 0]])
    assert (ball.radius_m, ball.name, made(BALL | {"name": "mine"}).name) == (0.5, "given", "mine")
    rod = made({"kind": "capsule", "from_m": [0, 0, 0], "to_m": [1, 0, 0], "radius_m": 0.1})
    assert np.array_equal(rod.points, [[0, 0, 0], [1, 0, 0]]) and np.array_equal(rod.triangles, [[0, 1, 1]])


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_floor_is_wide_and_faces_up(axis):
    up = "xyz".index(axis)
    floor = made({"kind": "floor", "axis": axis, "height_m": 0.7})
    a, b, c = floor.points[floor.triangles[0]]
    assert (floor.points[:, up] == 0.7).all() and floor.radius_m == 0.0
    normal = np.cross(b - a, c - a)
    assert normal[up] > 0.0 and not np.delete(normal, up).any()
    inner = np.full(3, 0.7)
    for side in ([-1, -1], [1, -1], [-1, 1], [1, 1]):  # a square of 40 sizes around the body is above the triangle
        inner[np.arange(3) != up] = np.delete(MIDDLE, up) + 2.0 * np.array(side)
        weights = np.linalg.lstsq(np.vstack([floor.points.T, np.ones(3)]), np.append(inner, 1.0), rcond=None)[0]
        assert (weights > 0.0).all()


def test_a_mesh_from_a_file(tmp_path):
    import pyvista

    pyvista.Cube().triangulate().save(tmp_path / "cube.stl")
    thing = made({"kind": "mesh", "file": str(tmp_path / "cube.stl"), "scale_m": 0.01, "radius_m": 0.002})
    assert len(thing.triangles) == 12 and np.ptp(thing.points, axis=0) == pytest.approx([0.01] * 3)
    assert thing.radius_m == 0.002


def test_paths():
    path = {"times_s": [1.0, 2.0, 4.0], "shifts_m": [[0, 0, 0], [1, 0, 0], [1, 2, -2]]}
    ball = made(BALL | path)
    for t, shift in ((0.0, [0, 0, 0]), (1.5, [0.5, 0, 0]), (3.0, [1, 1, -1]), (9.0, [1, 2, -2])):
        assert np.array_equal(ball.at(t), np.add(ball.points, shift))
    assert np.array_equal(made(BALL).at(5.0), made(BALL).points)


@pytest.mark.parametrize(
    "lengths",
    [{"center_m": [0, 0, 1e300]}, {"radius_m": 1e12}, {"times_s": [0, 1], "shifts_m": [[0, 0, 0], [0, 0, -1e300]]}],
)
def test_lengths_beyond_any_sense_are_refused(lengths):
    with pytest.raises(InputError, match=r"^there has a length of more than 1e\+09 m; give all lengths in metres\.$"):
        made(BALL | lengths)


@pytest.mark.parametrize(
    ("times", "shifts"),
    [([0.0, 1.0], [[0, 0, 0]]), ([1.0, 1.0], [[0, 0, 0]] * 2), ([1.0, 0.0], [[0, 0, 0]] * 2), ([], [[0, 0, 0]])],
)
def test_wrong_paths_are_refused(times, shifts):
    with pytest.raises(InputError, match=r"there: times_s has .* increasing order"):
        made(BALL | {"times_s": times, "shifts_m": shifts})
