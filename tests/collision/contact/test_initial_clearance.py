"""Initial states that contact refuses, and those that it accepts."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import particles_of
from palpate.collision.contact.obstacles import winding_number
from palpate.errors import InputError

FLOOR = {"kind": "floor", "height_m": 0.0}
BALL = {"kind": "sphere", "center_m": [0.05, 0.05, 0.2], "radius_m": 0.03}


def begin(play, parts, shifts, contact, **more):
    return play(parts, shifts, {"corotational": None, "contact": contact, **more}, steps=1)


@pytest.mark.parametrize(
    ("instrument", "message"),
    [
        (BALL | {"center_m": [0.05, 0.05, 0.05], "radius_m": 0.001}, "ball is inside cube"),
        (BALL | {"center_m": [0.05, 0.05, 0.12]}, "cube and ball touch"),
        (BALL | {"center_m": [0.05, 0.05, 0.13]}, "scenes.played: cube and ball touch"),
        (BALL | {"center_m": [0.05, 0.05, 0.13 + 5e-13]}, "cube and ball touch"),
        (
            {"kind": "capsule", "from_m": [0.05, 0.05, -0.1], "to_m": [0.04, 0.04, 0.2], "radius_m": 0.001},
            "intersects",
        ),
        (FLOOR | {"height_m": 0.05}, "cube intersects ball"),
        (FLOOR | {"height_m": 0.0}, "cube intersects ball"),
        (FLOOR | {"height_m": 0.3}, "cube is inside ball"),
        (FLOOR | {"height_m": 0.3, "axis": "x"}, "cube is inside ball"),
        (FLOOR | {"height_m": 0.3, "axis": "y"}, "cube is inside ball"),
    ],
)
def test_what_overlaps_at_first_is_refused(play, cube, instrument, message):
    with pytest.raises(InputError, match=message) as error:
        begin(play, [cube()], [[0, 0, 0]], {"instruments": [{"name": "ball"} | instrument]})
    assert str(error.value).count(". ") == 0 and "move" in str(error.value)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_above_a_floor_all_is_well(play, cube, axis):
    run = begin(play, [cube()], [[0, 0, 0]], {"instruments": [FLOOR | {"height_m": -1e-6, "axis": axis}]})
    assert np.isfinite(run.motion.positions).all()


@pytest.mark.parametrize(("shift", "message"), [(0.05, "cube_0 intersects cube_1"), (0.1, "intersects")])
def test_bodies_that_overlap_or_share_a_face_are_refused(play, cube, shift, message):
    with pytest.raises(InputError, match=message):
        begin(play, [cube()] * 2, [[0, 0, 0], [0, 0, shift]], {})


def test_a_body_inside_another_is_refused(play, cube):
    with pytest.raises(InputError, match="cube_1 is inside cube_0"):
        begin(play, [cube(), cube(side=0.02)], [[0, 0, 0], [0.04, 0.04, 0.04]], {})


def test_a_hollow_body_is_one_piece(play, cube):
    whole = cube(3)
    hollow = ~np.isclose(whole.nodes[whole.tetrahedra].mean(axis=1), 0.05, atol=1.0 / 60.0).all(axis=1)
    body = nest("shell", TetMesh(whole.nodes, whole.tetrahedra[hollow]), 0, np.empty(0, dtype=int), whole.material)
    assert hollow.sum() == len(hollow) - 6
    run = begin(play, [particles_of(body, 0, False)], [[0, 0, 0]], {"instruments": [FLOOR | {"height_m": -0.01}]})
    assert len(run.motion.obstacles) == 1


def test_a_crossed_sheet_is_refused_only_where_it_can_touch_itself(play, cloth):
    flat = cloth(3)
    crossed = replace(flat, nodes=0.1 * np.random.default_rng(0).normal(size=flat.nodes.shape))
    effects = {"triangles": None, "velocity_damping": {"rate_1_s": 1.0}}
    with pytest.raises(InputError, match="cloth intersects itself"):
        play([crossed], [[0, 0, 0]], effects | {"contact": {"self_contact": True}}, steps=1)
    play([crossed], [[0, 0, 0]], effects | {"contact": {}}, steps=1)


def test_the_winding_number_counts_solid_angles(cube):
    corners = cube(2).nodes[cube(2).triangles]
    assert winding_number(np.full(3, 0.05), corners) == pytest.approx(1.0, abs=1e-12)
    assert winding_number(np.array([0.1, 0.1, 0.1]) - 1e-9, corners) == pytest.approx(1.0, abs=1e-6)
    assert winding_number(np.array([0.2, 0.05, 0.05]), corners) == pytest.approx(0.0, abs=1e-12)
    faces = [corners[(corners[:, :, axis] == side).all(axis=1)] for axis in range(3) for side in (0.0, 0.1)]
    assert [winding_number(np.full(3, 0.05), face) for face in faces] == pytest.approx([1.0 / 6.0] * 6, abs=1e-12)
