"""Pictures of motion show what moved, from where it is seen, and repeat byte for byte."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from palpate.report import render, style
from palpate.scenes.motion import Motion, Moved
from palpate.studies.scenes.figures import motion


def shown(axis):
    """How many pixels of a still are not white, and the mean row of them in the body's right half."""
    ink = axis.images[0].get_array().min(axis=2) < 250
    rows, columns = np.nonzero(ink)
    return ink.sum(), rows[columns > np.median(columns)].mean()


def test_stills_begin_and_end_the_motion_and_do_not_miss_its_peak(sagging):
    figure = motion.stills(sagging, 5)
    stills, bar = figure.axes[:5], figure.axes[5]
    times = [float(axis.get_xlabel().removesuffix(" s")) for axis in stills]
    assert times == sorted(times) and times[0] == 0 and times[-1] == 1
    assert 0.5 in times
    peak_mm = 1e3 * np.linalg.norm(sagging.positions - sagging.positions[0], axis=2).max()
    assert bar.get_xlim() == pytest.approx((0, peak_mm))


def test_a_short_press_and_a_long_fall_are_shown(sagging):
    """The peak is one of the stills however short it lasts, and a body that falls far still has a picture."""
    positions = sagging.positions[:1].repeat(31, axis=0)
    positions[7, :, 2] -= 3.0
    figure = motion.stills(replace(sagging, positions=positions), 4)
    assert f"{sagging.times[7]:.3g} s" in [axis.get_xlabel() for axis in figure.axes]
    width, height = figure.axes[0].get_window_extent().size
    assert width > 100 and height < 400


@pytest.mark.parametrize("side", [1, -1])
def test_seen_from_above_unless_what_moves_looks_down(side):
    """A plate that lies flat, pressed on its upper or its lower face."""
    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]])
    triangles = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])[:, ::side]
    positions = np.stack([nodes, nodes])
    positions[1, 4, 2] = -0.2 * side
    cells = triangles, np.empty((0, 4), dtype=int)
    pressed = Motion("plate", np.array([0.0, 1.0]), positions, positions[0], *cells, np.arange(4), pd.DataFrame())
    assert np.sign(motion.Scenery(pressed).view.axes[2, 2]) == side


def test_what_bends_down_is_seen_to_bend_down(sagging):
    (size, rest), *_, (_, lowest), _, (_, back) = (shown(axis) for axis in motion.stills(sagging, 5).axes[:5])
    assert size > 5000
    assert lowest > rest + 20
    assert back == pytest.approx(rest, abs=0.5)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1, -1])
def test_motion_runs_up_or_down_the_view(sagging, axis, sign):
    way = np.zeros_like(sagging.positions)
    way[:, :, axis] = sign * 0.05 * sagging.times[:, None]
    moved = replace(sagging, positions=sagging.positions[0] + way, up=axis)
    view = motion.Scenery(moved).view
    assert abs(view.axes[1, axis]) > 0.9  # up or down, 20° off at most
    across = moved.positions.reshape(-1, 3) - view.centre
    assert np.abs(across @ view.axes[0]).max() < view.width / 2
    assert np.abs(across @ view.axes[1]).max() < view.height / 2


def test_a_floor_is_seen_from_above_though_the_body_moved_most_below_and_sideways(sagging):
    nodes, up = sagging.rest, np.eye(3)[2]
    bulge = (nodes[:, 2] == nodes[:, 2].min()) & (nodes[:, 1] == nodes[:, 1].max())
    positions = nodes + 0.2 * sagging.times[:, None, None] * bulge[:, None] * [1.0, 0.0, 0.0]
    corners = np.array([[-9.0, -9.0, -0.01], [27.0, -9.0, -0.01], [-9.0, 27.0, -0.01]])
    floor = Moved("floor_0", "floor", 0.0, np.repeat(corners[None], 31, axis=0), np.array([[0, 1, 2]]))
    sliding = replace(sagging, positions=positions, obstacles=(floor,), up=2)
    view = motion.Scenery(sliding).view
    assert view.axes[2] @ up > 0.3 and view.axes[1] @ up > 0.9
    colours = motion.stills(sliding, 3).axes[0].images[0].get_array()
    assert (colours == [211, 216, 221]).all(axis=2).sum() > 3000  # the floor's own, which is not the page's white


def test_both_sides_of_a_sheet_are_lit():
    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    below = np.diag([-1.0, 1, -1])
    with render.Stage(60, 60) as stage:
        greys = [
            stage.picture(
                render.View(axes, nodes.mean(axis=0), 1.5, 1.5),
                [lambda s: s.surface(nodes, triangles, None, None, None)],
            )[30, 30].mean()
            for axes in (np.eye(3), below)
        ]
    assert greys[0] == pytest.approx(greys[1], rel=0.02) and greys[0] > 150


def test_the_animation_loops_in_the_scenes_order_and_repeats_byte_for_byte(sagging, tmp_path):
    sagging = replace(sagging, times=sagging.times[::5], positions=sagging.positions[::5])
    for name in "ab":
        motion.animate(sagging, tmp_path / f"{name}.gif")
    data = (tmp_path / "a.gif").read_bytes()
    assert data == (tmp_path / "b.gif").read_bytes()
    assert len(data) <= 1_500_000
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.gif", "b.gif"]
    with Image.open(tmp_path / "a.gif") as gif:
        assert gif.info["loop"] == 0
        assert max(gif.size) >= 480 and gif.n_frames == len(sagging.times)
        lows = []
        for frame in (0, 3, 6):
            gif.seek(frame)
            rows, columns = np.nonzero(np.asarray(gif.convert("L"))[24:] < 245)
            lows.append(rows[columns > np.median(columns)].mean())
    assert lows[1] > lows[0] + 20
    assert lows[2] == pytest.approx(lows[0], abs=0.5)


def test_what_never_moves_and_nothing_held_can_be_drawn(sagging, tmp_path):
    still = replace(
        sagging, positions=sagging.positions[:1].repeat(4, axis=0), times=sagging.times[:4], held=np.array([])
    )
    figure = motion.stills(still, 3)
    assert figure.axes[0].get_xlabel() == "0 s"
    style.save(figure, tmp_path / "still")
    motion.animate(still, tmp_path / "still.gif")
    # all particles at one point to begin with
    burst = replace(sagging, positions=sagging.positions * np.linspace(0, 1, 31)[:, None, None])
    motion.stills(burst, 3)
