"""Errors of motion are drawn over their cost, and failures are counted."""

import pandas as pd

from palpate.report import style
from palpate.studies.dynamic import figures


def test_a_panel_a_scene_and_failures_counted(dynamic_table, tmp_path):
    figure = figures.draw_dynamic_accuracy(dynamic_table)
    assert [axis.get_title("left") for axis in figure.axes] == [
        f"{s}, 1 did not converge" for s in ("liver press", "bar sag")
    ]
    springs = figure.axes[0].lines[1]
    assert springs.get_ydata().tolist() == [5.0, 4.0]
    style.save(figure, tmp_path / "dynamic_accuracy")


def test_what_differs_in_more_than_the_step_is_on_no_curve(dynamic_table):
    looser = dynamic_table.iloc[[0]].assign(varied="tolerance", real_time_factor=0.5)
    first = figures.draw_dynamic_accuracy(pd.concat([dynamic_table, looser])).axes[0].lines
    assert [len(line.get_xdata()) for line in first[:3]] == [2, 1, 2] and first[1].get_linestyle() == "None"
