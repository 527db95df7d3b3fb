"""Errors of motion are drawn over their cost with failures counted; frames that are left out are shaded."""

import pandas as pd
import pytest
from fixtures.drawn import texts

from palpate.studies.dynamic import figures


def test_a_panel_a_scene_and_failures_counted(dynamic_table):
    axes = figures.draw_dynamic_accuracy(dynamic_table).axes
    titles = [f"{scene}, 1 did not converge" for scene in ("liver press", "bar sag")]
    assert [axis.get_title("left") for axis in axes] == titles
    assert [5.0, 4.0] in [list(line.get_ydata()) for line in axes[0].lines]  # springs
    # what differs in more than the step is on no curve
    looser = dynamic_table.iloc[[0]].assign(varied="tolerance", real_time_factor=0.5)
    lines = figures.draw_dynamic_accuracy(pd.concat([dynamic_table, looser], ignore_index=True)).axes[0].lines
    joined = [len(line.get_xdata()) for line in lines if line.get_linestyle() == "-" and line.get_marker() == "None"]
    assert joined == [2, 2] and [line.get_xdata()[0] for line in lines if line.get_marker() == "x"] == [0.5]


def test_what_the_truth_or_the_standard_may_be_wrong_by_is_shaded(dynamic_table):
    true = dynamic_table["scene"] == "bar_sag"
    table = dynamic_table.assign(reference=true.map({True: "fem_p2", False: "fem_fine"}), reference_error=0.002)
    axes = figures.draw_dynamic_accuracy(table).axes
    tops = [[patch.get_y() + patch.get_height() for patch in axis.patches] for axis in axes]
    assert tops == [[pytest.approx(0.2)]] * 2
    assert [word in texts(axis)[0] for axis, word in zip(axes, ("standard", "truth"), strict=True)] == [True, True]
    axes = figures.draw_dynamic_accuracy(dynamic_table).axes
    assert not any(axis.patches for axis in axes), "nobody knows it"


def test_a_line_a_step_and_what_is_left_out_is_shaded():
    rows = [
        [f"scene_{number}", step, time, change, 0.01, number > 0 or time < 0.25]
        for number in range(5)
        for step, change in ((0.02, 0.04), (0.01, 0.02))
        for time in (0.1, 0.2, 0.3)
    ]
    columns = ["scene", "step_s", "time_s", "change_of_peak", "bound", "resolved"]
    figure = figures.draw_dynamic_reference(pd.DataFrame(rows, columns=columns))
    assert [axis.get_title("left") for axis in figure.axes] == [f"scene {number}" for number in range(5)]
    first, second = figure.axes[:2]
    assert [line.get_ydata()[0] for line in first.lines] == [4.0, 2.0, 1.0]
    assert len(first.patches) == 1 and not second.patches


def test_forces_of_the_nearest_settings_are_drawn_beside_the_true_one(dynamic_table):
    table = dynamic_table.assign(force_rms_of_peak=dynamic_table["rmse_of_peak"])
    settings = [("fem_p2", "limit", 1.0), ("springs", "step_s=0.001", 2.0), ("fem_fine", "step_s=0.01", 0.5)]
    rows = [
        ["liver_press", model, setting, 0, time, 3.0 * size * time, 0.0, 4.0 * size * time]
        for model, setting, size in [*settings, ("springs", "step_s=0.002", 7.0)]
        for time in (0.1, 0.2)
    ]
    columns = ["scene", "model", "setting", "instrument", "time_s", "force_x_n", "force_y_n", "force_z_n"]
    figure = figures.draw_dynamic_force(table, pd.DataFrame(rows, columns=columns))
    (axis,) = figure.axes
    lines = [line.get_ydata().round(12).tolist() for line in axis.lines]
    assert lines == [[0.5, 1.0], [0.25, 0.5], [1.0, 2.0]] and axis.lines[0].get_xdata() == pytest.approx([0.05, 0.15])
