"""Errors over the steps of a press are drawn for every press and axis."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.report import style, tables
from palpate.studies.springs import figures


def test_every_press_and_axis_has_a_panel(spring_results):
    figure = figures.draw_spring_errors(spring_results["spring_errors"])
    titles = [axis.get_title("left") for axis in figure.axes]
    assert titles[0] == "top press, x (fitted)" and titles[-1] == "front press, z" and len(titles) == 9
    assert all(len(axis.lines) == 2 * len(figures.SHOWN) + 1 for axis in figure.axes)  # and zero
    assert "moved: 0.5 mm" in figure.axes[0].get_ylabel()
    assert figure.axes[1].lines[0].get_ydata()[-1] < 0.0  # signed
    assert figure.axes[0].lines[0].get_ydata()[-1] == pytest.approx(1e3 * 1e-5 * 5 * 0.066)  # the median seed


def test_a_band_is_the_range_of_seeds_and_a_run_that_ended_keeps_its_best(spring_results):
    found = tables.where(spring_results["spring_history"], method="genetic", volume_force=False)
    curves = figures.best_so_far(found, "seconds", np.array([0.5, 1.0, 11.5, 99.0]))
    assert np.isnan(curves[:, 0]).all()
    assert curves[:, 1] == pytest.approx(np.array([0.56, 0.566, 0.572]))
    assert curves[:, 2] == pytest.approx(np.array([0.06, 0.066, 0.072]) + 0.25)
    assert curves[:, 3] == pytest.approx(np.array([0.06, 0.066, 0.072]))


def test_the_fit_is_drawn_over_generations_and_time(spring_results):
    figure = figures.draw_spring_fit(spring_results["spring_history"])
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == [*(look.label for m, look in style.FITS.items() if m != "gradient_all"), labels[-1]]
    assert labels[-1] == "range of 3 seeds, line: median"
    assert [len(axis.lines) for axis in figure.axes[:2]] == [4, 4 + 2 * 3]  # over generations and over time


def test_the_floor_is_drawn_for_each_press(spring_results):
    axes = figures.draw_spring_floor(spring_results["spring_floor"]).axes
    assert [axis.get_title("left") for axis in axes] == ["top press", "left press", "front press"]
    alone, tied = axes[0].lines[1:]
    assert (alone.get_ydata() > tied.get_ydata()).all()


def test_an_unknown_way_has_no_colour():
    with pytest.raises(InputError, match="method annealing has no colour"):
        style.look("annealing")
