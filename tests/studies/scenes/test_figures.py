"""The force on an instrument is drawn over time and depth."""

from dataclasses import replace

import matplotlib.text
import numpy as np
import pandas as pd
import pytest

from palpate.report import style
from palpate.scenes.motion import Motion
from palpate.studies.scenes import figures, motion_pictures


@pytest.fixture
def felt() -> pd.DataFrame:
    t = np.linspace(0.0, 1.0, 21)
    depth = 0.02 * np.sin(np.pi * t) - 0.005
    force = 40.0 * depth.clip(min=0.0)
    across = dict.fromkeys(("force_x_n", "force_y_n"), np.zeros(21))
    table = pd.DataFrame({"time_s": t, **across, "force_z_n": force, "force_n": force, "depth_m": depth})
    return table.assign(scene="palpation", instrument="finger")


def test_each_instrument_has_its_force_in_newtons_and_its_depth_if_any_in_millimetres(felt, tmp_path):
    plate = felt.assign(instrument="plate", depth_m=np.nan, force_n=2.0)
    other = felt.assign(scene="other", instrument="hook")
    figure = figures.draw_contact_force(pd.concat([felt, plate, other]), scene="palpation")
    titles = [title for axis in figure.axes if "force on" in (title := axis.get_title(loc="left"))]
    assert titles == ["palpation: force on the finger", "palpation: force on the plate, which has no depth"]
    force, depth, loop = figure.axes[:3]
    assert force.lines[0].get_ydata() == pytest.approx(felt["force_n"].to_numpy())
    assert depth.lines[0].get_ydata().max() == pytest.approx(15.0)
    assert len(loop.collections[0].get_offsets()) == (felt["force_n"] > 0.0).sum()
    assert figure.axes[-1].lines[0].get_ydata() == pytest.approx(2.0)
    style.save(figure, tmp_path / "felt")
    for axis in (figure.axes[0], figure.axes[-1]):
        assert axis.get_legend().get_window_extent().x0 >= axis.get_window_extent().x1


def texts(axis):
    """What is written into a panel."""
    return [t.get_text().replace("\u00a0", " ") for t in axis.findobj(matplotlib.text.Annotation)]


def test_balance_is_the_sum_minus_the_work_and_gravity_begins_at_zero(scene_results):
    table = scene_results["energy"]
    press, sag = (figures.counted(table[table["scene"] == scene]) for scene in ("press", "sag"))
    np.testing.assert_allclose(press["balance_j"], -0.5e-3 * press["time_s"], atol=1e-15)
    assert sag["gravity_j"].iloc[0] == 0 and sag["total_j"].iloc[0] == 0
    assert sag["gravity_j"].iloc[-1] == pytest.approx(-2e-3)
    assert figures.of_effects(press) == ["kinetic_j", "springs_j"]
    assert figures.of_effects(sag) == ["kinetic_j", "gravity_j", "corotational_j"]


def test_a_sum_without_the_elastic_energy_is_not_shown(scene_results):
    press = scene_results["energy"].query("scene == 'press'").drop(columns="springs_j")
    assert not figures.whole(figures.counted(press))
    (axis,) = figures.draw_energy(press).axes
    assert len(axis.lines) == 3  # zero, kinetic, outer work
    assert axis.get_title("left") == "press, elastic energy not defined"


def shown(axis):
    """How many pixels of a still are not white, and the mean row of them in the body's right half."""
    ink = axis.images[0].get_array().min(axis=2) < 250
    rows, columns = np.nonzero(ink)
    return ink.sum(), rows[columns > np.median(columns)].mean()


def test_stills_begin_and_end_the_motion_do_not_miss_its_peak_and_bend_down(sagging):
    figure = motion_pictures.stills(sagging, 5)
    stills, bar = figure.axes[:5], figure.axes[5]
    times = [float(axis.get_xlabel().removesuffix(" s")) for axis in stills]
    assert times == sorted(times) and times[0] == 0 and times[-1] == 1
    assert 0.5 in times
    peak_mm = 1e3 * np.linalg.norm(sagging.positions - sagging.positions[0], axis=2).max()
    assert bar.get_xlim() == pytest.approx((0, peak_mm))
    (size, rest), *_, (_, lowest), _, (_, back) = (shown(axis) for axis in stills)
    assert size > 5000
    assert lowest > rest + 20
    assert back == pytest.approx(rest, abs=0.5)


@pytest.mark.parametrize("side", [1, -1])
def test_seen_from_above_unless_what_moves_looks_down(side):
    """A plate that lies flat, pressed on its upper or its lower face."""
    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]])
    triangles = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])[:, ::side]
    positions = np.stack([nodes, nodes])
    positions[1, 4, 2] = -0.2 * side
    cells = triangles, np.empty((0, 4), dtype=int)
    pressed = Motion("plate", np.array([0.0, 1.0]), positions, positions[0], *cells, np.arange(4), pd.DataFrame())
    assert np.sign(motion_pictures.Scenery(pressed).view.axes[2, 2]) == side


@pytest.mark.slow
def test_what_never_moves_and_nothing_held_can_be_drawn(sagging, tmp_path):
    positions = sagging.positions[:1].repeat(4, axis=0)
    still = replace(sagging, positions=positions, times=sagging.times[:4], held=np.array([]))
    assert motion_pictures.stills(still, 3).axes[0].get_xlabel() == "0 s"
    motion_pictures.animate(still, tmp_path / "still.gif")
    # all particles at one point to begin with
    burst = replace(sagging, positions=sagging.positions * np.linspace(0, 1, 31)[:, None, None])
    motion_pictures.stills(burst, 3)
