"""Figures of advice have what is advised, by budget, radius and kind of load, and when preparing pays."""

import numpy as np
import pytest
from fixtures import trade_off
from fixtures.drawn import texts
from fixtures.trade_off import OWN
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle

from palpate.benchmark.load import LOADS
from palpate.report.model_looks import look
from palpate.studies.tradeoff.figures import advice


def test_advice_shows_the_advised_and_the_next_best_in_each_budget_and_kind(trade_off_tables):
    settings = trade_off_tables["accuracy_vs_time"]
    figure = advice.draw_advice(trade_off.advice(settings, (0.0001, 1)), settings)
    titles = [axis.get_title("left") for axis in figure.axes]
    assert titles == ["within 0.0001 ms", "within 1 ms"] * 2
    assert [axis.get_xlabel().split(" [")[0] for axis in figure.axes] == ["RMSE"] * 2 + ["RMS at the patch"] * 2
    none, first, _, patch = ([text.get_text() for text in axis.texts] for axis in figure.axes)
    assert none == ["none"] * len(OWN)
    assert first[:2] == ["corrected coarse FEM: 1.1× the bound", "linear FEM + kernel ridge"]
    assert patch[:2] == ["linear FEM + kernel ridge: 1.1× the bound", "warped Green's functions"]


def test_what_is_below_the_error_of_the_truth_is_grey_and_own_models_are_named(trade_off_tables):
    settings = trade_off_tables["accuracy_vs_time"]
    figure = advice.draw_advice(trade_off.advice(settings, (1,)), settings)
    rms, patch = ([band.get_paths()[0].vertices[:, 0].max() for band in axis.collections] for axis in figure.axes)
    assert rms[-1] == pytest.approx(0.41) and patch[-1] == pytest.approx(0.8)
    own = {"detail_correction": "mine", "linear_residual": "nearest"}
    tables = (trade_off_tables[name].replace(own) for name in ("advice", "accuracy_vs_time"))
    assert "nearest" in "".join(texts(advice.draw_advice(*tables)))


@pytest.fixture
def flips():
    return advice.draw_advice_flips(trade_off.advice_by_radius())


def test_each_body_and_kind_of_error_has_its_panel(flips):
    assert [axis.get_title("left") for axis in flips.axes] == [
        f"{body}: error {kind}" for body in ("cylinder", "liver") for kind in ("over the surface", "at the patch")
    ]
    assert [text.get_text() for text in flips.axes[2].get_xticklabels()] == ["4", "8", "12", "20"]
    asked = [text.get_text().replace("\u00a0", " ") for text in flips.axes[0].get_yticklabels()]
    assert asked == ["within 1 ms", "within 16.7 ms", "at most 5 %", "at most 0.01 %"]


def test_a_cell_has_the_colour_of_its_model_its_error_and_a_line_where_the_model_changes(flips):
    surface, patch = flips.axes[:2]
    cells = [cell for cell in surface.patches if isinstance(cell, Rectangle)]
    models = ["linear_residual"] * 2 + ["linear_fem"] * 2 + ["detail_correction"] * 4
    assert [to_hex(cell.get_facecolor()) for cell in cells[:8]] == [look(model).colour for model in models]
    assert [text.replace("\u00a0", " ") for text in texts(patch) if text.startswith("7.5")] == ["7.5 %"] * 3
    assert texts(surface).count("none") == 4
    lines = [(line.get_xdata()[0], line.get_ydata()[0]) for line in surface.lines]
    assert lines == [(1.5, -0.5)]  # between 8 and 12 mm, first question


def test_every_kind_has_a_panel_with_its_errors_and_refusals():
    table = trade_off.any_load()
    axes = advice.draw_any_load(table).axes
    assert [axis.get_title("left") for axis in axes[:5]] == [*LOADS, "depth: the force"] and len(axes) == 10
    for axis, kind in zip(axes[:4], LOADS, strict=True):
        rows = table[(table["scene"] == "cylinder_large") & (table["kind"] == kind) & (table["refused"] == 0)]
        drawn = np.sort(np.concatenate([line.get_ydata() for line in axis.lines]))
        assert np.allclose(drawn, np.sort(100 * rows["rmse_of_peak"]))
    named = ["" if not axis.texts else axis.texts[0].get_text() for axis in axes[:4]]
    assert named == ["", "refused by\nlinear fine FEM", "refused by\nsprings", "refused by\nsprings"]
    forces = table[(table["scene"] == "liver_large") & table["force_error"].notna()]["force_error"]
    assert np.allclose(np.sort(np.concatenate([line.get_ydata() for line in axes[9].lines])), np.sort(100 * forces))
    # a setting that failed on some is hollow
    first = (table["model"] == "fem_p2") & (table["kind"] == "prepared")
    table.loc[first & (table["setting"] == "level=0, start=rest"), "failures"] = 1
    hollow = [line for line in advice.draw_any_load(table).axes[0].lines if line.get_markerfacecolor() == "white"]
    assert [list(line.get_xdata()) for line in hollow] == [[20.0]]


def test_preparing_pays_where_the_table_says(trade_off_tables):
    settings, advised = trade_off_tables["accuracy_vs_time"], trade_off_tables["advice"]
    axis = advice.draw_break_even(settings, advised).axes[0]
    dots = {line.get_xdata()[0]: line.get_ydata()[0] for line in axis.lines if line.get_marker() == "o"}
    offline, online, fine = 9.0, 0.012e-3, 0.45
    answers = offline / (fine - online)
    assert {round(x): round(y) for x, y in dots.items()}[round(answers)] == round(fine * answers)
    named = [text.get_text().replace("\u00a0", " ") for text in axis.get_legend().get_texts()]
    assert named[-1] == "linear fine FEM, 1.7 %" and len(named) == 3


def test_several_splits_have_one_line_for_each_setting(trade_off_tables):
    axis = advice.draw_break_even(trade_off.accuracy_vs_time((1, 2)), trade_off_tables["advice"]).axes[0]
    named = [text.get_text().rsplit(",", 1)[0] for text in axis.get_legend().get_texts()]
    assert len(named) == len(set(named))


@pytest.mark.parametrize("longer", ["", ", modes=snapshots, rings=50, thinned=0.003, target=limit, and as much again"])
def test_names_hide_no_line_and_leave_the_panels_their_width(trade_off_tables, longer):
    settings, advised = (trade_off_tables[name].copy() for name in ("accuracy_vs_time", "advice"))
    for table in (settings, advised):
        table["setting"] += longer
    figure = advice.draw_break_even(settings, advised)
    figure.draw_without_rendering()
    for axis in figure.axes:
        assert axis.get_legend().get_window_extent().y1 < axis.get_window_extent().y0
        assert axis.get_position().width > 0.8 / len({each.get_position().x0 for each in figure.axes})
