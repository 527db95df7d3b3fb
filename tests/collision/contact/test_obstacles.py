"""Obstacles: their shapes, their paths, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.mesh import TetMesh, winding_number
from palpate.bodies.particles import particles_of
from palpate.collision.contact.obstacles import displace_nodes, make_obstacle
from palpate.collision.contact.proximity import Proximity, limit
from palpate.effects.settings import Ball, Capsule, Contact, Floor, Triangles, VelocityDamping
from palpate.errors import InputError, NotConverged

MIDDLE = np.array([0.3, 0.2, 0.1])
BALL = Ball(center_m=[1.0, 2.0, 3.0], radius_m=0.5)


def made(tool, size=0.1):
    return make_obstacle(tool, "there", "given", size, MIDDLE)


def test_shapes():
    ball = made(BALL)
    assert np.array_equal(ball.points, [[1.0, 2.0, 3.0]]) and np.array_equal(ball.triangles, [[0, 0, 0]])
    assert (ball.radius_m, ball.name, made(BALL.but(name="mine")).name) == (0.5, "given", "mine")
    rod = made(Capsule(from_m=[0, 0, 0], to_m=[1, 0, 0], radius_m=0.1))
    assert np.array_equal(rod.points, [[0, 0, 0], [1, 0, 0]]) and np.array_equal(rod.triangles, [[0, 1, 1]])


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_floor_is_wide_and_faces_up(axis):
    up = "xyz".index(axis)
    floor = made(Floor(axis=axis, height_m=0.7))
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
    thing = made(Triangles(file=str(tmp_path / "cube.stl"), scale_m=0.01, radius_m=0.002))
    assert len(thing.triangles) == 12 and np.ptp(thing.points, axis=0) == pytest.approx([0.01] * 3)
    assert thing.radius_m == 0.002


def test_paths():
    ball = made(BALL.but(times_s=[1.0, 2.0, 4.0], shifts_m=[[0, 0, 0], [1, 0, 0], [1, 2, -2]]))
    for t, shift in ((0.0, [0, 0, 0]), (1.5, [0.5, 0, 0]), (3.0, [1, 1, -1]), (9.0, [1, 2, -2])):
        assert np.array_equal(ball.at(t), np.add(ball.points, shift))
    assert np.array_equal(made(BALL).at(5.0), made(BALL).points)


@pytest.mark.parametrize(
    "lengths",
    [{"center_m": [0, 0, 1e300]}, {"radius_m": 1e12}, {"times_s": [0, 1], "shifts_m": [[0, 0, 0], [0, 0, -1e300]]}],
)
def test_lengths_beyond_any_sense_are_refused(lengths):
    with pytest.raises(InputError, match=r"^there has a length of more than 1e\+09 m; give all lengths in metres\.$"):
        made(BALL.but(**lengths))


def meet(play, cube, tool):
    return play([cube], steps=1, contact=Contact(instruments=[tool]))


def above(z, radius_m=0.03):
    return Ball(name="tool", center_m=[0.05, 0.05, z], radius_m=radius_m)


def floor(height_m, axis="z"):
    return Floor(name="tool", height_m=height_m, axis=axis)


@pytest.mark.parametrize(
    ("instrument", "message"),
    [
        (above(0.05, 0.001), "tool is inside cube"),
        (above(0.12), "cube and tool touch"),
        (above(0.13), "scenes.played: cube and tool touch"),
        (above(0.13 + 5e-13), "cube and tool touch"),
        (Capsule(from_m=[0.05, 0.05, -0.1], to_m=[0.04, 0.04, 0.2], radius_m=0.001), "intersects"),
        (floor(0.05), "cube intersects tool"),
        (floor(0.0), "cube intersects tool"),
        (floor(0.3), "cube is inside tool"),
        (floor(0.3, "x"), "cube is inside tool"),
        (floor(0.3, "y"), "cube is inside tool"),
    ],
)
def test_what_overlaps_at_first_is_refused(play, cube, instrument, message):
    with pytest.raises(InputError, match=message) as error:
        meet(play, cube(), instrument)
    assert str(error.value).count(". ") == 0 and "move" in str(error.value)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_above_a_floor_all_is_well(play, cube, axis):
    assert np.isfinite(meet(play, cube(), floor(-1e-6, axis)).motion.positions).all()


@pytest.mark.parametrize(("shift", "message"), [(0.05, "cube_0 intersects cube_1"), (0.1, "intersects")])
def test_bodies_that_overlap_or_share_a_face_are_refused(play, cube, shift, message):
    with pytest.raises(InputError, match=message):
        play([cube()] * 2, [[0, 0, 0], [0, 0, shift]], steps=1, contact=Contact())


def test_a_body_inside_another_is_refused(play, cube):
    with pytest.raises(InputError, match="cube_1 is inside cube_0"):
        play([cube(), cube(side=0.02)], [[0, 0, 0], [0.04, 0.04, 0.04]], steps=1, contact=Contact())


def test_a_hollow_body_is_one_piece(play, cube):
    whole = cube(3)
    hollow = ~np.isclose(whole.nodes[whole.tetrahedra].mean(axis=1), 0.05, atol=1.0 / 60.0).all(axis=1)
    body = nest("shell", TetMesh(whole.nodes, whole.tetrahedra[hollow]), 0, np.empty(0, dtype=int), whole.material)
    assert hollow.sum() == len(hollow) - 6
    run = meet(play, particles_of(body, 0, False), floor(-0.01))
    assert len(run.motion.obstacles) == 1


def test_a_crossed_sheet_is_refused_only_where_it_can_touch_itself(play, cloth):
    flat = cloth(3)
    crossed = replace(flat, nodes=0.1 * np.random.default_rng(0).normal(size=flat.nodes.shape))
    damping = VelocityDamping(rate_1_s=1.0)
    with pytest.raises(InputError, match="cloth intersects itself"):
        play([crossed], steps=1, velocity_damping=damping, contact=Contact(self_contact=True))
    play([crossed], steps=1, velocity_damping=damping, contact=Contact())


def test_the_winding_number_counts_solid_angles(cube):
    corners = cube(2).nodes[cube(2).triangles]
    assert winding_number(np.full(3, 0.05), corners) == pytest.approx(1.0, abs=1e-12)
    assert winding_number(np.array([0.1, 0.1, 0.1]) - 1e-9, corners) == pytest.approx(1.0, abs=1e-6)
    assert winding_number(np.array([0.2, 0.05, 0.05]), corners) == pytest.approx(0.0, abs=1e-12)
    faces = [corners[(corners[:, :, axis] == side).all(axis=1)] for axis in range(3) for side in (0.0, 0.1)]
    assert [winding_number(np.full(3, 0.05), face) for face in faces] == pytest.approx([1.0 / 6.0] * 6, abs=1e-12)


GAP = 1e-3


@pytest.fixture
def scene(cube):
    """Make proximity and points of a cube under a rod; the rod's two points are last."""
    body = cube(2)
    rod = np.array([[-0.05, 0.05, 0.112], [0.15, 0.05, 0.112]])
    points = np.vstack([body.nodes, rod])
    n = len(body.nodes)
    surfaces = [body.triangles, np.array([[n, n + 1, n + 1]])]
    can_touch = np.array([[False, True], [True, False]])
    return Proximity(points, surfaces, np.array([0.0, 0.01]), can_touch, np.ones(n + 2), GAP), points, n


def moved(scene, way):
    proximity, points, n = scene
    motion = np.zeros_like(points)
    motion[n:] = way
    return displace_nodes(proximity, points, motion, n, ["cube", "rod"]), motion


def test_nodes_beside_the_path_stay(scene):
    for way in ([0.0, 0.0, 1.0], [0.0, 0.02, 0.0], [0.0, 0.0, -0.0017]):
        assert np.array_equal(moved(scene, way)[0], scene[1][: scene[2]])


@pytest.mark.parametrize("depth", [0.003, 0.03, 0.3, 3.0])
def test_nodes_in_the_path_make_the_whole_motion_and_nothing_intersects(scene, depth):
    proximity, points, n = scene
    reached, motion = moved(scene, [0.0, 0.0, -depth])
    gone = reached - points[:n]
    taken = gone.any(axis=1)
    assert taken.any()
    assert gone[taken] == pytest.approx(np.tile([0.0, 0.0, -depth], (taken.sum(), 1)), abs=1e-15)
    near = proximity.find_near(points, depth)
    motion[:n] = gone
    assert limit(near.kinds, near.nodes, near.offsets, near.known, points, motion, 0.0) == 1.0
    assert (near.clearances(np.vstack([reached, points[n:] - [0.0, 0.0, depth]])) > 0.0).all()


def test_held_nodes_stop_it_with_one_sentence(scene):
    proximity, _, n = scene
    proximity.movable[:n] = False
    proximity.movable[n:] = True
    sentence = "^rod is driven into held nodes, or between two instruments; change its path$"
    with pytest.raises(NotConverged, match=sentence):
        moved(scene, [0.0, 0.0, -0.03])
