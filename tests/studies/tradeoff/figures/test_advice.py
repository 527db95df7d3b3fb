"""The advised model of each budget is drawn with the next best, for both kinds of error."""

import pytest
from fixtures.drawn import texts
from fixtures.trade_off import OWN
from fixtures.trade_off import advice as made_up

from palpate.studies.tradeoff.figures import advice


def test_advice_shows_the_advised_and_the_next_best_in_each_budget_and_kind(trade_off_tables):
    settings = trade_off_tables["accuracy_vs_time"]
    figure = advice.draw_advice(made_up(settings, (0.0001, 1)), settings)
    titles = [axis.get_title("left") for axis in figure.axes]
    assert titles == ["within 0.0001 ms", "within 1 ms"] * 2
    assert [axis.get_xlabel().split(" [")[0] for axis in figure.axes] == ["RMSE"] * 2 + ["RMS at the patch"] * 2
    none, first, _, patch = ([text.get_text() for text in axis.texts] for axis in figure.axes)
    assert none == ["none"] * len(OWN)
    assert first[:2] == ["corrected coarse FEM: 1.1×", "linear FEM + kernel ridge"]
    assert patch[:2] == ["linear FEM + kernel ridge: 1.1×", "warped Green's functions"]


def test_what_is_below_the_error_of_the_truth_is_grey(trade_off_tables):
    settings = trade_off_tables["accuracy_vs_time"]
    figure = advice.draw_advice(made_up(settings, (1,)), settings)
    rms, patch = ([band.get_paths()[0].vertices[:, 0].max() for band in axis.collections] for axis in figure.axes)
    assert rms[-1] == pytest.approx(0.41) and patch[-1] == pytest.approx(0.8)


def test_own_models_are_drawn_wherever_they_come(trade_off_tables):
    settings, advised = (
        trade_off_tables[name].replace({"detail_correction": "mine", "linear_residual": "nearest"})
        for name in ("accuracy_vs_time", "advice")
    )
    assert "nearest" in "".join(texts(advice.draw_advice(advised, settings)))
