"""What report, figures and words of advice make of one made-up table: its numbers in their units, and no other."""

import re

import numpy as np
import pandas as pd
import pytest
from fixtures import trade_off as made_up
from fixtures.drawn import texts
from fixtures.material import STUDIES, failures, numbers, page
from fixtures.trade_off import OWN, accuracy_vs_time

from palpate.benchmark.advice import advise, advise_motion
from palpate.benchmark.engine_scores import ANSWERS
from palpate.benchmark.load import LOADS
from palpate.benchmark.press_measure import CHOSEN_BY, ERRORS
from palpate.benchmark.presses import PRESSURE
from palpate.benchmark.ranking import TRUTH, UNKNOWN, averaged, own_error
from palpate.files import read_yaml
from palpate.models.model_registry import MODELS, RESERVED
from palpate.report import page as report
from palpate.report import tables
from palpate.report.advice_words import SAME, advice_list, by_limit, lines, say
from palpate.report.model_looks import look
from palpate.report.work_precision import LEAST_PERCENT
from palpate.studies.tradeoff import report as tradeoff
from palpate.studies.tradeoff.figures import advice as advice_figures
from palpate.studies.tradeoff.figures import precision
from palpate.studies.tradeoff.figures import truth as truth_figures
from palpate.studies.tradeoff.figures.scene_rows import answers, curves, front_rows

FAMILIES = read_yaml(STUDIES / "tradeoff/models.yaml")


@pytest.fixture
def found(trade_off_tables):
    return {name: trade_off_tables[name].copy() for name in ("accuracy_vs_time", "advice", "truth", "error_bounds")}


# Numbers of the report


def test_numbers_of_the_run(found):
    said = numbers("tradeoff", found)
    assert said["settings"] == 135 and said["failed"] == 30
    several = numbers("tradeoff", found | {"accuracy_vs_time": accuracy_vs_time((1, 2, 3))})
    assert 1.1 < several["spread"] < 1.5 and several["settings"] == 135
    assert [text.replace("\u00a0", " ") for text in said["truth_errors"]] == [
        "0.06 % to 0.41 % (at most 1.2 %)",
        "0.1 % to 0.8 % (at most 1.6 %)",
    ]


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


def test_answers_to_presses_without_a_truth_are_a_column_where_there_are_such(found):
    head = "presses without a truth answered"
    assert head not in numbers("tradeoff", found)["described"]
    settings = found["accuracy_vs_time"]
    here = settings["scene"] == "liver_deep"
    settings.loc[here, "rejected"] = 2
    settings.loc[here & (settings["model"] == "pod_rbf"), "rejected_answered"] = 1
    said = numbers("tradeoff", found)
    described = said["described"].set_index("model")[head]
    assert described["reduced basis"] == "5 of 10" and described["linear elements (P1)"] == "0 of 30"
    assert [one["scene"] for one in said["scenes"] if head in one["front"]] == ["liver_deep"]


def test_models_are_counted_by_what_they_are_given_by_variant_and_by_family(found):
    settings = found["accuracy_vs_time"]
    given = tradeoff.given_table(settings).set_index("is given")
    prepared = given.loc["the load, at a contact that was prepared"]
    assert len(given) == 3 and prepared["least RMSE"].replace("\u00a0", " ") == "0.6 % to 1.6 %"
    assert not given["models"].str.contains("no displacement").any()
    assert len(tradeoff.variants_table(settings)) == 16
    assert tradeoff.variants_table(settings[~settings["model"].str.contains("ordered_|framed_|springs")]).empty
    names = ["fem_p1", "fem_p1", "springs", "springs_nodal", "pod_rbf", "mine"]
    measured = pd.DataFrame({"model": names, "setting": [f"k={i}" for i in range(len(names))]})
    rows = tradeoff.models_table(measured.assign(rejected=0, rejected_answered=0), FAMILIES).set_index("model")
    assert set(rows.index) == {"linear elements (P1)", "mass-spring", "reduced basis", "mine"}
    assert rows.loc["linear elements (P1)", ["variants", "settings of each"]].tolist() == [1, 2]
    assert rows.loc["mass-spring", ["variants", "settings of each"]].tolist() == [2, 1]


def test_every_model_is_described_once():
    described = [name for family in FAMILIES for name in family["names"]]
    assert len(described) == len(set(described)) and set(MODELS) | set(RESERVED) <= set(described)
    assert all({"family", "short", "what", "before", "setting"} <= set(family) for family in FAMILIES)


def test_settings_that_failed_are_listed(found):
    settings = found["accuracy_vs_time"]
    settings["failure"] = settings["failure"].where(settings["failures"] == 0, "no way down")
    failed = failures("tradeoff", found)
    assert len(failed) == 30 and failed[0][1:] == ("cylinder, small loads", "2 of 15 test samples: no way down")


@pytest.mark.slow
def test_the_page_has_every_figure_and_only_those_of_the_run(found, trade_off_tables, tmp_path):
    row = dict.fromkeys(ANSWERS.columns, 0.1) | {"engine": "Elsewhere", "scene": "cylinder_large", "model": "Elsewhere"}
    elsewhere = ANSWERS.frame([row | {"setting": "fine", "version": "1", "hardware": "a card", "law": "corotational"}])
    asked = (found["advice"]["max_error"] == 0.05) & (found["advice"]["error"] == "rms")
    found["advice"].loc[asked, "rmse_of_peak"] = 0.07
    some = {name: trade_off_tables[name] for name in ("limit_points", "any_load")} | {"answers": elsewhere}
    drawn = ["advice", "break_even", "truth", "error_bounds", *(f"work_precision_{scene}" for scene in OWN)]
    drawn_of = {"limit_points": "limit_points", "any_load": "any_load", "answers": "answers_cylinder_large"}
    for more in ({}, some):
        folder = tmp_path / str(len(more))
        (folder / "tables").mkdir(parents=True)
        (folder / "figures").mkdir()
        for name, table in (found | more).items():
            table.to_csv(folder / "tables" / f"{name}.csv", index=False)
        names = [*drawn, *(drawn_of[name] for name in more)]
        for name in [*names, *(f"best_models_{scene}" for scene in OWN)]:
            for suffix in ("svg", "png"):
                (folder / "figures" / f"{name}.{suffix}").write_text(f'<svg width="9pt" height="9pt">{name}</svg>')
        report.write(folder, folder / "report.html", ["tradeoff"], more=list(more))
        text = (folder / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
        assert set(re.findall(r'<figure id="figure_(\w+)">', text)) == set(names)
        assert text.count('<source media="(max-width: 44rem)"') == len(OWN)  # a small diagram for narrow screens
        assert text.count("beware: on the test contacts its error is larger than asked, 7 %") == 7
        assert not re.search(r"\{[a-z_]+\}", text.split("</style>")[1].split("<script>")[0])


# Words of advice


@pytest.fixture
def pressed(trade_off):
    settings, errors = trade_off
    return settings[settings["scene"] == "liver_small"], errors["liver_small"]


def test_lines_have_error_bound_time_preparation_and_margin(advised_tables):
    liver = tables.where(advised_tables[1], scene="liver_small")
    none, first, second = (lines(liver.iloc[i]) for i in range(3))
    assert none.startswith("liver_small, within 0.01 ms: none\n") and "in 12 µs for the slowest press" in none
    assert first.startswith("liver_small, within 1 ms: linear_fem\n") and "error     5 % of the peak" in first
    assert "less than 7.7 %, by 12 contacts, 36 presses" in first and "has 3.9 times the bound" in first
    assert "margin    99 % of the allowed time" in first and "prepared  3 s of preparation, 50 MB" in first
    assert "error     0.41 % of" in second and "6 ms for the slowest press" in second
    row = liver.iloc[1].copy()
    row["bound_of_peak"], row["contacts"], row["presses"] = np.nan, 8, 24
    assert "bound     none, as 8 contacts, 24 presses are too few" in lines(row) and "nan" not in lines(row)


def test_what_is_doubtful_is_told_with_its_numbers(pressed):
    settings, errors = pressed
    given = settings.assign(rejected=4, rejected_answered=np.where(settings["model"] == "pod_rbf", 3, 0))
    told = [lines(advise(table, errors, [16.7], kinds=["rms"]).iloc[0]) for table in (settings, given)]
    assert ["3 of 4 presses without a truth" in text for text in told] == [False, True]
    risky = advise(*pressed, [], [0.0021], kinds=["rms"]).iloc[0]
    assert say("nearest", risky).replace("\u00a0", " ").endswith("25 % of its answers are above 0.21 %")
    above = advise(*pressed, [], [0.08], kinds=["rms"]).iloc[0].copy()
    assert "larger than asked" not in lines(above)
    above["rmse_of_peak"], above["margin"] = 0.09, -24.0
    assert "its error is larger than asked, 9 %" in lines(above).splitlines()[1]
    assert "larger than asked, 9 %" in advice_list(above.to_frame().T)


def test_both_kinds_of_error_are_named_and_the_list_is_of_one(pressed):
    advice = advise(*pressed, [16.7], [0.07])
    surface, patch = (lines(tables.where(advice, error=kind).iloc[0]) for kind in ("rms", "patch"))
    assert "at the patch 0.62 %" in surface and "over the whole surface 0.41 %" in patch
    surface, patch = advice_list(advice).splitlines(), advice_list(advice, "patch").splitlines()
    assert "0.41 % (nine in ten below 0.69 %" in surface[1] and "0.62 % (nine in ten below 1 %" in patch[1]


def test_a_table_repeats_no_cell_and_counts_none_as_one():
    taken = {"a": ["fem", "fem", "springs", "fem"], "b": ["none", "none", "none", "fem"]}
    limits = [{"budget_ms": 1.0}, {"budget_ms": 100.0}, {"max_error": 0.05}, {"max_error": 0.01}]
    rows = [
        {"scene": scene, "budget_ms": np.nan, "max_error": np.nan, "model": model} | limit
        for scene, models in taken.items()
        for model, limit in zip(models, limits, strict=True)
    ]
    table = by_limit(pd.DataFrame(rows), {"b": "second", "a": "first"}, lambda row: row["model"])
    second, first = ["second", "none", "none", "none", "fem"], ["first", "fem", SAME, "springs", "fem"]
    assert table.values.tolist() == [second, first]


def test_a_motion_has_error_bound_and_speed(dynamic_table):
    table = dynamic_table[dynamic_table["scene"] == "liver_press"].replace({"springs": "moving_modes"})
    table = table.replace({"setting": {"step_s=0.002": "step_s=0.07", "step_s=0.001": "step_s=0.035"}})
    costs = {"estimate_of_peak": 0.03, "ms_per_step": 1.0, "step_p95_ms": 2.0, "step_max_ms": 3.0, "offline_s": 0.5}
    table = table.assign(body="liver", p95_of_peak=0.06, **costs)
    bound = {"scene": "liver_press", "model": "moving_modes", "setting": "step_s=0.035", "estimate": "constant"}
    bound |= {"places": 12, "failures": 0, "bound_of_peak": 0.07, "coverage": 0.9}
    bounds = pd.DataFrame([bound, bound | {"setting": "step_s=0.07", "bound_of_peak": np.nan, "failures": 3}])
    press = {"scene": "liver_small", "body": "liver", "model": "fem_p1", "rmse_of_peak": 0.004}
    levels = [f"level={level}, start=rest, tolerance=1e-08" for level in range(3)]
    presses = pd.DataFrame([press | {"patch_rms_of_peak": 0.01, "setting": level} for level in levels])
    known = {"bounds": bounds, "pressed": presses}

    text = lines(advise_motion(table, max_errors=[0.08], **known).iloc[0])
    assert "a standard that is 0.9 % wrong itself, so 4.9 % with it" in text and "5 × real time" in text
    assert "wrong by less than 7 %; measured on 12 other places" in text and "held for 90 %" in text
    found = advise_motion(table, speeds=[4, 8, 100], **known)
    assert found["setting"].fillna("").tolist() == ["step_s=0.035", "step_s=0.07", ""]
    assert found["margin"].tolist()[:2] == pytest.approx([0.2, 0.2])
    assert "20 % of the allowed time is left" in lines(found.iloc[0])
    assert advise_motion(table, max_errors=[0.05], **known).iloc[0]["nearest_bound"] == 0.07
    alone = advise_motion(table, max_errors=[0.05], pressed=presses).iloc[0]
    assert say("bound", alone).startswith("on this path only") and "on this path only" in say("cell", alone)
    assert say("bound", found.iloc[1]) == "on this path only, as this setting answered at 9 of 12 other places"


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


def test_errors_over_time_have_every_model_the_truths_own_error_and_the_best_blend(found):
    settings, advice = found["accuracy_vs_time"], found["advice"]
    rms, patch, *_ = precision.draw_work_precision(settings, advice, scene="liver_small").axes
    for model in ("fem_p1", "fem_p2", "linear_residual", "warped_compliance", "mass_spring", "shape_matching"):
        assert of(rms, model) and of(patch, model)
    tops = [max(p.get_y() + p.get_height() for p in axis.patches) for axis in (rms, patch)]
    assert tops == [pytest.approx(0.09), pytest.approx(0.3)]
    blends = curves(answers(averaged(settings[settings["scene"] == "liver_small"])))["paper_enrichment"]
    best = blends[blends["model"] == "unordered_signed"]
    drawn = {place for line in of(rms, "paper_enrichment") for place in zip(*line.get_data(), strict=True)}
    assert blends["model"].nunique() == 12 and 1 < len(drawn) < 6
    assert drawn <= set(zip(1e3 * best["online_median_s"], 100 * best["rmse_of_peak"], strict=True))
    settings.loc[settings["model"] == "linear_fem", "rmse_of_peak"] = 1e-12
    axis = precision.draw_work_precision(settings, advice, scene="liver_small").axes[0]
    assert {mark.get_ydata()[0] for mark in of(axis, "linear_fem")} == {LEAST_PERCENT}


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


def test_the_small_diagram_has_the_front_the_truth_and_the_zero_answer(trade_off_tables):
    table = trade_off_tables["accuracy_vs_time"]
    figure = precision.draw_best_models(table, trade_off_tables["advice"], scene="liver_small")
    axis, written = figure.axes[0], [text.replace("\u00a0", " ") for text in texts(figure)]
    assert "1  linear fine FEM: 1.7 % in 12 µs" in written and "4  corrected coarse FEM: 0.6 % in 3.8 ms" in written
    (grey,) = (line for line in axis.lines if line.get_markersize() == 3)
    shown = (table["scene"] == "liver_small") & (table["failures"] == 0) & ~table["model"].isin(["zero", "truth"])
    assert len(grey.get_xdata()) == shown.sum()  # what failed on some samples has no place, nor truth and zero answer
    assert max(patch.get_y() + patch.get_height() for patch in axis.patches) == pytest.approx(0.09)
    assert [line.get_ydata()[0] for line in axis.lines if line.get_color() == look("zero").colour] == [33.0]


def test_advice_is_grey_below_the_error_of_the_truth(trade_off_tables):
    settings = trade_off_tables["accuracy_vs_time"]
    axes = advice_figures.draw_advice(made_up.advice(settings, (1,)), settings).axes
    rms, patch = ([band.get_paths()[0].vertices[:, 0].max() for band in axis.collections] for axis in axes)
    assert rms[-1] == pytest.approx(0.41) and patch[-1] == pytest.approx(0.8)


def test_every_kind_of_load_has_its_errors_and_the_force():
    table = made_up.any_load()
    axes = advice_figures.draw_any_load(table).axes
    for axis, kind in zip(axes[:4], LOADS, strict=True):
        rows = table[(table["scene"] == "cylinder_large") & (table["kind"] == kind) & (table["refused"] == 0)]
        drawn = np.sort(np.concatenate([line.get_ydata() for line in axis.lines if line.get_marker() != "None"]))
        assert np.allclose(drawn, np.sort(100 * rows["rmse_of_peak"]))
    forces = table[(table["scene"] == "liver_large") & table["force_error"].notna()]["force_error"]
    drawn = np.concatenate([line.get_ydata() for line in axes[9].lines if line.get_marker() != "None"])
    assert np.allclose(np.sort(drawn), np.sort(100 * forces))


def test_preparing_pays_where_the_table_says(trade_off_tables):
    axis = advice_figures.draw_break_even(trade_off_tables["accuracy_vs_time"], trade_off_tables["advice"]).axes[0]
    dots = {line.get_xdata()[0]: line.get_ydata()[0] for line in axis.lines if line.get_marker() == "o"}
    offline, online, fine = 9.0, 0.012e-3, 0.45
    paid = offline / (fine - online)
    assert {round(x): round(y) for x, y in dots.items()}[round(paid)] == round(fine * paid)


def test_truths_have_their_errors_in_percent_and_their_orders():
    table = made_up.truth()
    table = table.assign(rmse_of_peak_max=3 * table["rmse_of_peak"], ratio_min=2.0, ratio_max=4.0)
    table = table.assign(other_element=0.002, other_element_own=0.001, other_element_patch=0.02)
    table = table.assign(other_element_own_patch=0.01, geometry_patch_of_peak=0.08)
    table["geometry_of_peak"] = [0.05] + [float("nan")] * (len(table) - 1)
    errors, order = truth_figures.draw_truth(table).axes
    points = {line.get_label(): list(line.get_xdata()) for line in errors.lines if line.get_marker() in "osD"}
    assert points["over the surface, RMSE of peak"] == [pytest.approx(100 * rms) for rms, _ in OWN.values()]
    assert points["at the patch, RMS of peak"] == [pytest.approx(100 * patch) for _, patch in OWN.values()]
    (orders,) = (line for line in order.lines if line.get_marker() == "o")
    assert list(orders.get_xdata()) == list(table["order"])
    ends = [segment[-1, 0] for segment in errors.collections[0].get_segments()]
    assert ends == [pytest.approx(300 * rms) for rms, _ in OWN.values()]
    assert order.collections[0].get_segments()[0][:, 0] == pytest.approx([1, 2])  # of ratios 2 and 4
    crosses = [list(line.get_xdata()) for line in errors.lines if line.get_marker() == "x"]
    assert crosses[0] == [pytest.approx(250 * rms) for rms, _ in OWN.values()]
    triangles = [line.get_xdata() for line in errors.lines if line.get_marker() == "^"]
    assert triangles[0][0] == pytest.approx(5) and list(triangles[1]) == [pytest.approx(8)] * len(table)


def test_sharpness_and_coverage_of_each_estimate_are_drawn():
    left, right = truth_figures.draw_error_bounds(made_up.error_bounds()).axes
    points = [line for line in left.lines if line.get_marker() == "o"]
    assert [set(line.get_ydata()) for line in points] == [{4.0}, {1.3}]
    assert set(points[0].get_xdata()) == {0.0} and set(points[1].get_xdata()) == {0.95}
    full, hollow = ([line for line in right.lines if line.get_mfc() == kind] for kind in ("#9a9a9a", "none"))
    assert set(full[0].get_ydata()) == {96.0}
    assert np.nanmax(hollow[0].get_ydata()) == pytest.approx(20.0)


def test_only_the_contact_that_snaps_is_marked():
    table = made_up.limit_points()
    cylinder, liver = truth_figures.draw_limit_points(table).axes[:2]
    thick = [[line for line in axis.lines if line.get_linewidth() == 2.5] for axis in (cylinder, liver)]
    assert thick[0] == [] and [list(line.get_xdata()) for line in thick[1]] == [[0.29, 0.31]]
    first = table[(table["body"] == "cylinder") & (table["contact"] == 0)]
    assert list(cylinder.collections[0].get_array()) == list(first["least_det"])
    assert [line.get_xdata()[0] for line in cylinder.lines if line.get_linestyle() == ":"] == [PRESSURE]
