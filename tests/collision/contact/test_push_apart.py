"""Bodies and instruments that begin inside each other are moved apart on the shortest way, where the scene asks."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.collision.contact import push_apart
from palpate.errors import InputError

BALL = {"kind": "sphere", "name": "ball", "center_m": [0.05, 0.05, 0.11], "radius_m": 0.02}
FLOOR = {"kind": "floor", "height_m": 0.02}


def placed(play, parts, shifts, **contact):
    """Return the first and the last frame of three steps without weight, and the clearances of the last one."""
    effects = {"corotational": None, "contact": {"push_out": True, **contact}}
    if any(len(part.held) for part in parts):
        effects["held"] = None
    motion = play(parts, shifts, effects, steps=3).motion
    return motion, motion.positions[0], motion.positions[-1]


def test_two_boxes_part_along_their_least_overlap(play, cube, trespass):
    motion, first, _ = placed(play, [cube(2)] * 2, [[0, 0, 0], [0.01, 0.02, 0.06]])
    lower, upper = first[:27], first[27:]
    # equal masses: each goes half of the 4 cm and the gap, and neither is deformed
    assert upper[:, 2].min() - lower[:, 2].max() == pytest.approx(1e-4, rel=0.3)
    np.testing.assert_allclose(lower - cube(2).nodes, np.broadcast_to([0, 0, -0.02005], (27, 3)), atol=2e-5)
    assert trespass(motion)[1] == 0


def test_the_lighter_one_goes_and_a_held_one_stays(play, cube):
    heavy = replace(cube(1), masses=99.0 * cube(1).masses)
    _, first, _ = placed(play, [cube(1), heavy], [[0, 0, 0], [0, 0, 0.09]])
    ways = np.abs(first - np.vstack([heavy.nodes, heavy.nodes + np.array([0, 0, 0.09])]))[[0, -1], 2]
    assert ways[0] == pytest.approx(99.0 * ways[1], rel=1e-6)
    held = cube(1, held=np.array([0]))
    _, first, _ = placed(play, [cube(1), held], [[0, 0, 0], [0, 0, 0.09]])
    np.testing.assert_array_equal(first[8:], held.nodes + np.array([0, 0, 0.09]))


def test_a_body_rises_from_a_floor_and_leaves_a_ball(play, cube, trespass):
    motion, first, _ = placed(play, [cube(1)], [[0, 0, 0]], instruments=[FLOOR])
    assert first[:, 2].min() == pytest.approx(0.0201, rel=1e-2)
    np.testing.assert_array_equal(first[:, :2], cube(1).nodes[:, :2])
    motion, first, _ = placed(play, [cube(2)], [[0, 0, 0]], instruments=[BALL])
    assert first[:, 2].max() == pytest.approx(0.09, abs=3e-4)
    assert trespass(motion)[0] > 0.0


def test_an_instrument_dents_what_is_held(play, cube, trespass):
    block = cube(4)
    block = replace(block, held=np.flatnonzero(block.nodes[:, 2] == 0.0))
    motion, _, last = placed(play, [block], [[0, 0, 0]], instruments=[BALL])
    np.testing.assert_array_equal(last[block.held], block.nodes[block.held])
    touched = np.linalg.norm(block.nodes - BALL["center_m"], axis=1).argmin()
    assert 0.0 < np.linalg.norm(last[touched] - BALL["center_m"]) - 0.02 < 1e-3
    assert trespass(motion)[0] > 0.0 and motion.observed["ball_force_z_n"].iloc[-1] > 0.0


@pytest.mark.parametrize(
    ("parts", "shifts", "contact", "sentence"),
    [
        ([[0], [0]], [[0, 0, 0], [0, 0, 0.05]], {}, "intersects .* since push_out found no way out"),
        ([range(7)], [[0, 0, 0]], {"instruments": [BALL]}, "push_out: ball is driven into held nodes"),
    ],
)
def test_what_cannot_move_is_refused(play, cube, parts, shifts, contact, sentence):
    with pytest.raises(InputError, match=rf"^scenes.played: .*{sentence}"):
        placed(play, [cube(1, held=np.array(held)) for held in parts], shifts, **contact)


def test_nothing_changes_where_nothing_overlaps_and_nothing_is_pushed_unless_asked(play, cube):
    _, first, _ = placed(play, [cube(1)] * 2, [[0, 0, 0], [0, 0, 0.2]])
    np.testing.assert_array_equal(first, np.vstack([cube(1).nodes, cube(1).nodes + np.array([0, 0, 0.2])]))
    with pytest.raises(InputError, match="move them apart"):
        placed(play, [cube(1)] * 2, [[0, 0, 0], [0, 0, 0.05]], push_out=False)


def test_the_way_is_the_shortest_between_the_hulls():
    box = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=float)
    side = push_apart.Side(box, np.empty((0, 3, 3)), 0.0, False)
    other = replace(side, points=box + np.array([0.7, 0.2, 0.1]))
    np.testing.assert_allclose(push_apart.least_way(side, other, 0.01), [-0.31, 0, 0], atol=1e-12)
