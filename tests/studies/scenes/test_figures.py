"""The force on an instrument is drawn over time and depth."""

from dataclasses import replace

import matplotlib.text
import numpy as np
import pandas as pd
import pytest

from palpate.scenes.motion import Motion
from palpate.studies.scenes import figures, motion_pictures


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
