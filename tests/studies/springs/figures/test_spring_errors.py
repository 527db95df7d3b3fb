"""Errors over the steps of a press are drawn for every press and axis."""

import pytest

from palpate.studies.springs import figures


def test_every_press_and_axis_has_a_panel(spring_results):
    figure = figures.draw_spring_errors(spring_results["spring_errors"])
    titles = [axis.get_title("left") for axis in figure.axes]
    assert titles[0] == "top press, x (fitted)" and titles[-1] == "front press, z" and len(titles) == 9
    assert all(len(axis.lines) == 2 * len(figures.SHOWN) + 1 for axis in figure.axes)  # and zero
    assert "moved: 0.5 mm" in figure.axes[0].get_ylabel()
    assert figure.axes[1].lines[0].get_ydata()[-1] < 0.0  # signed
    assert figure.axes[0].lines[0].get_ydata()[-1] == pytest.approx(1e3 * 1e-5 * 5 * 0.066)  # the median seed
