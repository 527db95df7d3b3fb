"""Diagrams of error over time show every model, the truth, the zero answer, failures and fronts, or the front alone."""

import re

import numpy as np
import pandas as pd
import pytest
from fixtures.drawn import texts
from fixtures.trade_off import accuracy_vs_time

from palpate.benchmark.ranking import averaged
from palpate.report import style
from palpate.report.model_looks import look
from palpate.studies.tradeoff.figures import precision
from palpate.studies.tradeoff.figures.scene_rows import answers, curves


@pytest.fixture
def found(trade_off_tables):
    return [trade_off_tables[name].copy() for name in ("accuracy_vs_time", "advice")]


def draw(settings, advice, scene="liver_small"):
    return precision.draw_work_precision(settings, advice, scene=scene)


BLENDS = "paper_enrichment"


def plain(figure) -> list[str]:
    return [text.replace("\u00a0", " ") for text in texts(figure)]


def on_front(axis) -> list[str]:
    """The models that a list below a panel names, with their settings."""
    return [re.match(r"\d  (.*):", line)[1] for line in axis.texts[0].get_text().split("\n")]


def of(panel, model: str) -> list:
    """The points of a model in a panel."""
    shown = look(model)
    lines = [line for line in panel.lines if line.get_marker() == shown.marker]
    return [line for line in lines if shown.colour in (line.get_color(), line.get_markeredgecolor())]


def test_both_panels_have_every_model_and_their_own_front(found, tmp_path):
    figure = draw(*found)
    rms, patch, rms_front, patch_front, _ = figure.axes
    written = plain(figure)
    for model in ("fem_p1", "fem_p2", "linear_residual", "warped_compliance", "mass_spring", "shape_matching", BLENDS):
        assert any(look(model).label in text for text in written)
        assert of(rms, model) and of(patch, model)
    assert [rms.get_ylabel(), patch.get_ylabel()] == [
        "error over the surface, RMSE [% of peak]",
        "error at the patch, RMS [% of peak]",
    ]
    first = ["linear fine FEM", "linear FEM + kernel ridge (samples=42)"]
    assert on_front(rms_front)[:2] == on_front(patch_front)[:2] == first
    assert "warped Green's functions (samples=42)" in on_front(patch_front)
    assert "warped Green's functions (samples=42)" not in on_front(rms_front)  # clearly worse than linear + ridge there
    assert "1 ms:\nlinear FEM +\nkernel ridge" in written
    style.save(figure, tmp_path / "work_precision")


def test_the_band_is_the_truths_own_error_of_each_kind_and_the_line_the_zero_answer(found):
    rms, patch = draw(*found).axes[:2]
    tops = [max(p.get_y() + p.get_height() for p in axis.patches) for axis in (rms, patch)]
    assert tops == [pytest.approx(0.09), pytest.approx(0.3)]
    assert "grey: below the error of the truth itself, 0.09 %; models are tied" in plain(rms)
    assert "no displacement at all: 33 %" in plain(rms) and "no displacement at all: 88 %" in plain(patch)


def test_a_truth_that_is_not_well_known_says_so(found):
    assert any("The truth is known to 0.41 % only" in text for text in plain(draw(*found, scene="liver_large")))
    settings, advice = found
    without = settings[settings["model"] != "truth"]
    assert any("is not known" in text for text in plain(draw(without, advice)))
    settings.loc[settings["model"] == "truth", "validation_patch_rms_of_peak"] = 0.019
    rms, patch, *_ = draw(settings, advice).axes
    [told] = [text for text in plain(patch) if "truth" in text]
    assert told.replace("\n", " ") == "The truth is known to 1.9 % only, not to 0.3 % (grey: models are tied)"
    assert "grey: below the error of the truth itself, 0.09 %; models are tied" in plain(rms)
    assert all(len(line) <= precision.WIDTH for line in told.split("\n"))


def test_lines_and_rims_show_who_is_told_what(found):
    panel = draw(*found).axes[0]
    rims = {
        model: {mark.get_markeredgecolor() for mark in of(panel, model) if mark.get_linestyle() == "None"}
        for model in ("linear_fem", "fem_p2")
    }
    # a start from the linear response needs a prepared contact
    assert rims == {"linear_fem": {"black"}, "fem_p2": {"white", "black"}}
    styles = {
        line.get_color(): line.is_dashed()
        for line in panel.lines
        if len(line.get_xdata()) > 1 and line.get_marker() == "None"
    }
    assert styles[look("kernel_ridge_detail").colour] and styles[look(BLENDS).colour]
    assert not styles[look("detail_correction").colour] and not styles[look("fem_p2").colour]


def test_the_blends_of_paper_1_are_one_curve_of_the_best_and_levels_of_elements_are_named(found):
    settings = averaged(found[0][found[0]["scene"] == "liver_small"])
    blends = curves(answers(settings))[BLENDS]
    assert blends["model"].nunique() == 12
    panel = draw(*found).axes[0]
    drawn = {(mark.get_xdata()[0], mark.get_ydata()[0]) for mark in of(panel, BLENDS) if len(mark.get_xdata()) == 1}
    best = blends[blends["model"] == "unordered_signed"]
    assert drawn <= set(zip(*precision.milliseconds_and_percent(best), strict=True))
    assert 1 < len(drawn) < 6
    levels = sorted(text for text in plain(panel) if re.fullmatch(r"L\d", text))
    assert levels == ["L0", "L0", "L1", "L1", "L2", "L2"]


def test_settings_meant_for_the_limit_are_a_curve_of_their_own(found):
    settings, advice = found
    extra = settings[(settings["model"] == "fem_p2") & (settings["scene"] == "liver_small")].copy()
    extra["setting"] += ", target=limit"
    extra[["rmse_of_peak", "patch_rms_of_peak"]] /= 5.0

    def lines(table):
        axis = draw(table, advice).axes[0]
        curves = [
            line for line in axis.lines if line.get_color() == look("fem_p2").colour and line.get_linewidth() == 1.4
        ]
        return [line.is_dashed() for line in curves], [line for line in axis.lines if line.get_marker() == "."]

    assert lines(settings) == ([False], [])
    both, dots = lines(pd.concat([settings, extra]))
    assert both == [False, True] and len(dots) == len(extra)
    written = plain(precision.draw_best_models(pd.concat([settings, extra]), advice, scene="liver_small"))
    assert any(f"{look('fem_p2').label}, limit:" in text for text in written)


def test_what_failed_is_hollow_named_and_on_no_front(found):
    settings, advice = found
    figure = draw(settings, advice)
    hollow = [line for line in figure.axes[0].lines if line.get_markerfacecolor() == "white"]
    assert len(hollow) == 3
    failed = next(text for text in plain(figure) if text.startswith("failed: ")).replace("\n", " ")
    assert "linear elements (P1) (level=2, start=rest, tolerance=1e-08) on 2 of 15" in failed
    all_lost = settings["model"] == "linear_residual"
    settings.loc[all_lost, ["rmse_of_peak", "patch_rms_of_peak", "online_median_s", "online_p95_s"]] = np.nan
    settings.loc[all_lost, "failures"] = 15
    assert "linear FEM + kernel ridge (samples=42)" not in on_front(draw(settings, advice).axes[2])


def test_several_splits_are_drawn_as_means_with_a_band(found):
    splits = accuracy_vs_time((1, 2, 3))
    figure = draw(splits, found[1])
    assert "means of 3 splits" in figure.axes[0].get_title("left") and figure.axes[0].collections
    rows = splits[(splits["scene"] == "liver_small") & (splits["model"] == "linear_fem")]
    (mark,) = (mark for mark in of(figure.axes[0], "linear_fem") if mark.get_linestyle() == "None")
    assert mark.get_ydata()[0] == pytest.approx(100 * rows["rmse_of_peak"].mean())


def test_a_setting_whose_number_of_samples_differs_between_splits_is_one_setting(found):
    splits = accuracy_vs_time((1, 2))
    splits = splits[splits["scene"] == "liver_small"]
    second = splits["split"] == 2
    splits.loc[second, "setting"] = splits.loc[second, "setting"].str.replace("samples=42", "samples=45")
    assert len(averaged(splits)) == second.sum()
    fewer = pd.concat([splits[~second], splits[second & (splits["setting"] != "samples=45")]])
    assert len(averaged(fewer)) == second.sum()  # by name, where splits have not tried as many


def test_all_but_exact_answers_are_drawn_at_the_edge(found):
    settings, advice = found
    settings.loc[settings["model"] == "linear_fem", "rmse_of_peak"] = 1e-12
    axis = draw(settings, advice).axes[0]
    assert {mark.get_ydata()[0] for mark in of(axis, "linear_fem")} == {precision.LEAST_PERCENT}


def test_own_models_are_drawn_wherever_they_come(found):
    written = plain(draw(*(table.replace({"detail_correction": "mine", "linear_fem": "other"}) for table in found)))
    assert {"mine", "other"} <= set(written)


def test_long_settings_leave_the_panels_their_width(found):
    settings, advice = found

    def width(settings) -> float:
        figure = draw(settings, advice)
        figure.draw_without_rendering()
        return figure.axes[0].get_position().width

    longer = settings.assign(setting=settings["setting"].where(settings["model"] != "linear_fem", "word " * 40))
    assert width(longer) == pytest.approx(width(settings), abs=1e-3)


def test_numbers_of_points_beside_each_other_do_not_overlap(found):
    settings, advice = found
    first = settings["model"] == "linear_fem"
    settings.loc[first, ["online_median_s", "rmse_of_peak"]] = 65e-6, 0.0117
    second = (settings["model"] == "linear_residual") & (settings["setting"] == "samples=42")
    settings.loc[second, ["online_median_s", "rmse_of_peak"]] = 68e-6, 0.0115
    axis = draw(settings, advice).axes[0]
    places = [text.get_position() for text in axis.texts if text.get_text() in ("1", "2")]
    assert len(set(places)) == 2


@pytest.fixture
def small(trade_off_tables):
    return precision.draw_best_models(
        trade_off_tables["accuracy_vs_time"], trade_off_tables["advice"], scene="liver_small"
    )


def test_the_front_is_numbered_and_named(small, tmp_path):
    written = plain(small)
    assert [text for text in written if text.isdigit() and len(text) == 1] == ["1", "2", "3", "4"]
    assert "1  linear fine FEM: 1.7 % in 12 µs" in written and "4  corrected coarse FEM: 0.6 % in 3.8 ms" in written
    assert "16.7 ms" in written
    style.save(small, tmp_path / "best_models")


def test_only_the_front_is_coloured(small, trade_off_tables):
    axis = small.axes[0]
    large = [line.get_color() for line in axis.lines if line.get_markersize() > 10]
    assert large == [look(name).colour for name in ("linear_fem", "linear_residual", *["detail_correction"] * 2)]
    (grey,) = (line for line in axis.lines if line.get_markersize() == 3)
    table = trade_off_tables["accuracy_vs_time"]
    shown = (table["scene"] == "liver_small") & (table["failures"] == 0) & ~table["model"].isin(["zero", "truth"])
    assert len(grey.get_xdata()) == shown.sum()  # what failed on some samples has no place, nor truth and zero answer


def test_the_truth_and_the_zero_answer_limit_the_errors(small):
    axis = small.axes[0]
    assert max(patch.get_y() + patch.get_height() for patch in axis.patches) == pytest.approx(0.09)
    assert [line.get_ydata()[0] for line in axis.lines if line.get_color() == look("zero").colour] == [33.0]
    assert 96 * small.get_figwidth() < 390 - 32  # of a telephone
