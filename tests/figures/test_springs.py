"""The pictures and sentences about spring parameters say what their tables say."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.figures import tables
from palpate.figures.springs import spring_errors, spring_fit, spring_floor, spring_looks
from palpate.report.numbers import numbers
from palpate.report.parts import springs

PUBLISHED = {"springs": {"source": "Chen", "fitness_m": -0.05, "generations": 1000, "seconds": 3600}}


def test_a_band_is_the_range_of_seeds_and_a_run_that_ended_keeps_its_best(spring_results):
    found = tables.where(spring_results["spring_history"], method="genetic", volume_force=False)
    curves = spring_fit.best_so_far(found, "seconds", np.array([0.5, 1.0, 11.5, 99.0]))
    assert np.isnan(curves[:, 0]).all()
    assert curves[:, 1] == pytest.approx(np.array([0.56, 0.566, 0.572]))
    assert curves[:, 2] == pytest.approx(np.array([0.06, 0.066, 0.072]) + 0.25)
    assert curves[:, 3] == pytest.approx(np.array([0.06, 0.066, 0.072]))


def test_the_fit_is_drawn_over_generations_and_time(spring_results):
    figure = spring_fit.draw(spring_results["spring_history"])
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == [*(look.label for m, look in spring_looks.FITS.items() if m != "gradient_all"), labels[-1]]
    assert labels[-1] == "range of 3 seeds, line: median"
    over_generations, over_time = figure.axes[:2]
    assert len(over_generations.lines) == 4
    assert len(over_time.lines) == 4 + 2 * 3


def test_every_press_and_axis_has_a_panel(spring_results):
    figure = spring_errors.draw(spring_results["spring_errors"])
    titles = [axis.get_title("left") for axis in figure.axes]
    assert titles[0] == "top press, x (fitted)" and titles[-1] == "front press, z" and len(titles) == 9
    assert all(len(axis.lines) == 2 * len(spring_errors.SHOWN) for axis in figure.axes)
    assert figure.axes[0].lines[0].get_ydata()[-1] == pytest.approx(1e3 * 1e-5 * 5 * 0.066)  # the median seed


def test_the_floor_is_drawn_for_each_press(spring_results):
    figure = spring_floor.draw(spring_results["spring_floor"])
    assert [axis.get_title("left") for axis in figure.axes] == ["top press", "left press", "front press"]
    alone, tied = figure.axes[0].lines[1:]
    assert (alone.get_ydata() > tied.get_ydata()).all()


def test_sentences_come_from_the_tables(spring_results):
    found = numbers(spring_results, PUBLISHED, ["springs"], [])
    found = {name: text.replace("\u00a0", " ") for name, text in found.items()}
    assert found["spring_found"].startswith(
        "genetic algorithm (the paper) -0.066 (-0.072 to -0.06, 3 seeds) in 10 s, 20 generations or iterations"
    )
    # -0.03 - 0.5 (1 - i/10) is above -0.066 at i = 10 only
    assert found["spring_passed"].startswith("after 11 s (springs alone)")
    assert found["spring_smooth"] == "top 4.5 %, left 14 %, front 14 %"
    ways = "gradient by the adjoint ({0}), gradient, moduli kept alike ({0})"  # 3 and 4.5 %, others three times as much
    forces = ("springs alone", "springs and volume force")
    assert found["spring_met"] == ", ".join(ways.format(force) for force in forces)
    assert found["spring_all"] == "top 4 %, left 4 %, front 4 %"
    assert found["spring_floor"] == "11 % at 0.1, 12 % at 0.25, 15 % at 0.49"
    assert (
        "(the paper: about 1 h); the adjoint's gradient is past them after 11 s and ends with 55 % less error on"
        in (found["headline_springs"])
    )


def test_a_gradient_that_never_passes_is_told(spring_results):
    history = spring_results["spring_history"].copy()
    history.loc[history["method"] == "gradient", "fitness"] = -1.0
    found = numbers(spring_results | {"spring_history": history}, PUBLISHED, ["springs"], [])
    assert found["spring_passed"] == "never (springs alone) and never (with volume)"


def test_medians_and_ranges_are_tabulated(spring_results):
    text = springs._medians(spring_results["spring_fit"]).replace("\u00a0", " ")
    assert "6.6 % [6 %, 7.2 %] (fitted)" in text and "20 % [18 %, 22 %]" in text


def test_an_unknown_way_has_no_colour():
    with pytest.raises(InputError, match="method annealing has no colour"):
        spring_looks.look("annealing")
