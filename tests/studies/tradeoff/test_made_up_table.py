"""What report, figures and words of advice make of one made-up table: its numbers in their units, and no other."""

import numpy as np
import pandas as pd
import pytest
from fixtures.material import STUDIES, numbers, page
from fixtures.trade_off import accuracy_vs_time

from palpate.benchmark.press_measure import CHOSEN_BY, ERRORS
from palpate.benchmark.ranking import TRUTH, UNKNOWN, averaged, own_error
from palpate.files import read_yaml
from palpate.models.model_registry import MODELS, RESERVED
from palpate.report import tables
from palpate.report.advice_words import advice_list
from palpate.report.model_looks import look
from palpate.studies.tradeoff import report as tradeoff
from palpate.studies.tradeoff.figures import precision
from palpate.studies.tradeoff.figures.scene_rows import front_rows

FAMILIES = read_yaml(STUDIES / "tradeoff/models.yaml")


@pytest.fixture
def found(trade_off_tables):
    return {name: trade_off_tables[name].copy() for name in ("accuracy_vs_time", "advice", "truth", "error_bounds")}


# Numbers of the report


def test_the_dent_is_compared_with_the_surface_where_a_model_is_advised(found):
    advice = found["advice"]
    rms = advice["error"].eq("rms") & advice["model"].ne("none")
    advice.loc[rms, "patch_rms_of_peak"] = 3.0 * advice.loc[rms, "rmse_of_peak"]
    advice.loc[rms & advice["scene"].eq("liver_small"), "patch_rms_of_peak"] *= 2.0
    factors = numbers("tradeoff", found)["dent"].set_index("scene")
    assert factors.loc["liver, small loads", "median factor"] == pytest.approx(6.0)
    assert factors.loc["all of these", ["least factor", "largest factor"]].tolist() == pytest.approx([3.0, 6.0])
    assert factors.loc["liver, small loads", "radius of the finger [mm]"] == "12"


def test_without_a_truth_no_number_stands_for_its_error(found):
    """Where every press of the hardest scene was rejected, it is said what is measured instead, and why."""
    settings, truth = found["accuracy_vs_time"], found["truth"]
    settings.loc[settings["scene"] == "liver_deep", "online_median_s"] *= 2
    here, own = truth["scene"] == "liver_deep", [name for name in truth if "of_peak" in name or name == "relative_l2"]
    truth.loc[here, own] = np.nan
    truth.loc[here, ["samples", "rejected"]] = [0, 12]
    truth["why_rejected"] = np.where(here, "12 the levels are too far apart", "")
    mine = (settings["scene"] == "liver_deep") & (settings["model"] == TRUTH)
    settings.loc[mine, [*ERRORS, *(f"validation_{name}" for name in CHOSEN_BY)]] = np.nan
    assert np.isnan(own_error(settings[settings["scene"] == "liver_deep"]))
    text = " ".join(page("tradeoff", found).split())
    answer = text[text.index("[answer best_models_liver_deep]") : text.index("What is compared")]
    assert UNKNOWN in answer and "nan" not in answer and "itself is known to" not in answer
    advice = found["advice"].assign(reference_error=np.nan)
    said = advice_list(advice[advice["scene"] == "liver_deep"])
    assert UNKNOWN in said and "nan" not in said


def test_snaps_are_those_of_the_table(trade_off_tables):
    table = trade_off_tables["limit_points"]
    snaps = tradeoff.snaps(table)  # the contact whose equilibrium is lost counts, too
    assert (snaps["count"], snaps["every"]) == (2, 12)
    assert (snaps["first"]["pressure_of_young_before"], snaps["first"]["pressure_of_young_after"]) == (0.29, 0.31)
    assert tradeoff.snaps(table[table["body"] == "cylinder"]) == {"count": 0, "every": 6, "first": {}}


def test_every_model_is_described_once():
    described = [name for family in FAMILIES for name in family["names"]]
    assert len(described) == len(set(described)) and set(MODELS) | set(RESERVED) <= set(described)
    assert all({"family", "short", "what", "before", "setting"} <= set(family) for family in FAMILIES)


# Words of advice


# Figures


def test_below_the_truths_own_error_models_are_tied_and_the_fastest_stays(trade_off_tables):
    table = trade_off_tables["accuracy_vs_time"]
    settings = averaged(tables.where(table, scene="liver_small"))
    assert own_error(settings) == 0.0009 and own_error(settings, "patch_rms_of_peak") == 0.003
    assert list(front_rows(settings)["model"])[-1] == "detail_correction"
    settings.loc[settings["model"] == "truth", "rmse_of_peak"] = 0.01
    assert list(front_rows(settings)["model"]) == ["linear_fem", "linear_residual"]
    for scene in tables.scenes(table):
        assert not {"truth", "zero"} & set(front_rows(averaged(tables.where(table, scene=scene)))["model"])


def of(panel, model: str) -> list:
    """The points of a model in a panel."""
    shown = look(model)
    lines = [line for line in panel.lines if line.get_marker() == shown.marker]
    return [line for line in lines if shown.colour in (line.get_color(), line.get_markeredgecolor())]


def test_several_splits_are_drawn_as_means(found):
    splits = accuracy_vs_time((1, 2, 3))
    splits = splits[splits["scene"] == "liver_small"]
    axis = precision.draw_work_precision(splits, found["advice"], scene="liver_small").axes[0]
    (mark,) = (mark for mark in of(axis, "linear_fem") if mark.get_linestyle() == "None")
    rows = splits[splits["model"] == "linear_fem"]
    assert mark.get_ydata()[0] == pytest.approx(100 * rows["rmse_of_peak"].mean())
    splits = splits[splits["split"] < 3]
    second = splits["split"] == 2
    # a setting whose number of samples differs between splits is one
    splits.loc[second, "setting"] = splits.loc[second, "setting"].str.replace("samples=42", "samples=45")
    assert len(averaged(splits)) == second.sum()
    fewer = pd.concat([splits[~second], splits[second & (splits["setting"] != "samples=45")]])
    assert len(averaged(fewer)) == second.sum()  # by name, where splits have not tried as many
