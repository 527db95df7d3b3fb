"""Tables and numbers about accuracy and time follow from the tables."""

import re

import numpy as np
import pandas as pd
import pytest
from fixtures.material import STUDIES, material, numbers, page
from fixtures.trade_off import OWN, accuracy_vs_time

from palpate.benchmark.engine_scores import ANSWERS
from palpate.benchmark.measure import CHOSEN_BY, ERRORS
from palpate.benchmark.ranking import TRUTH, UNKNOWN, own_error
from palpate.files import read_yaml
from palpate.models.model_registry import MODELS, RESERVED
from palpate.report import page as report
from palpate.report.advice_words import advice_list
from palpate.studies.tradeoff import report as tradeoff

FAMILIES = read_yaml(STUDIES / "tradeoff/models.yaml")
FIGURES = ["advice", "break_even", "truth", "error_bounds", *(f"work_precision_{scene}" for scene in OWN)]


@pytest.fixture
def found(trade_off_tables):
    return {name: trade_off_tables[name].copy() for name in ("accuracy_vs_time", "advice", "truth", "error_bounds")}


def test_numbers_of_the_run(found):
    said = numbers("tradeoff", found)
    assert (said["models"], said["settings"]) == ("13 methods (one in 12 variants, one in 4 variants)", 135)
    assert said["failed"] == 30 and said["splits"] == 1 and said["samples"] == "15"
    several = numbers("tradeoff", found | {"accuracy_vs_time": accuracy_vs_time((1, 2, 3))})
    assert several["splits"] == 3 and 1.1 < several["spread"] < 1.5 and several["settings"] == 135
    assert [text.replace("\u00a0", " ") for text in said["truth_errors"]] == [
        "0.06 % to 0.41 % (at most 1.2 %)",
        "0.1 % to 0.8 % (at most 1.6 %)",
    ]
    text = " ".join(page("tradeoff", found).split())
    assert "Within 0.0001 ms, no model in 6 of 6 scenes;" in text
    assert "within 1 ms, linear FEM + kernel ridge in 6 of 6 scenes (error 0.9 % to 2.3 %)" in text


def test_the_answer_says_how_far_away_the_truth_is_how_well_it_is_known_and_the_dent(found):
    settings = found["accuracy_vs_time"]
    settings.loc[settings["scene"] == "liver_deep", "online_median_s"] *= 2
    text = " ".join(page("tradeoff", found).split())
    answer = text[text.index("[answer best_models_liver_deep]") : text.index("**Within")]
    assert "liver under deep loads: one answer of quadratic elements (P2) on its finest mesh takes 5.38 s." in answer
    own = accuracy_vs_time().query("scene == 'liver_deep' and model == 'truth'").iloc[0]
    assert own["validation_patch_rms_of_peak"] <= own["patch_rms_of_peak"] == 0.006
    assert answer.count("known to 0.15 % (greatest 0.6 %), in the dent to 0.6 % (greatest 1.8 %).") == 1
    assert "In the dent it errs by 7.8 % within 1 ms (warped Green's functions; nine in " in answer
    assert "Within 1 ms (fast enough for force feedback to a hand), take linear FEM + ker" in answer
    assert "nine in ten below 3.6 %, 24 contacts, 44 presses) in 120 µs (slowest press 150 µs); prepared in 5" in answer
    assert "0.0001 ms, no model answers in time: nothing fits." in answer
    assert not answer.endswith("none: nothing fits. ")


def test_the_dent_is_compared_with_the_surface_where_a_model_is_advised(found):
    advice = found["advice"]
    rms = advice["error"].eq("rms") & advice["model"].ne("none")
    advice.loc[rms, "patch_rms_of_peak"] = 3.0 * advice.loc[rms, "rmse_of_peak"]
    advice.loc[rms & advice["scene"].eq("liver_small"), "patch_rms_of_peak"] *= 2.0
    factors = numbers("tradeoff", found)["dent"].set_index("scene")
    assert factors.loc["liver, small loads", "median factor"] == pytest.approx(6.0)
    assert factors.loc["all of these", ["least factor", "largest factor"]].tolist() == pytest.approx([3.0, 6.0])
    assert factors.loc["liver, small loads", "radius of the finger [mm]"] == "12"


def test_every_diagram_says_what_facets_change(found):
    truth = found["truth"].assign(geometry_of_peak=0.046, geometry_patch_of_peak=0.054)
    said = tradeoff.facets(truth.iloc[:1]).replace("\u00a0", " ")
    assert "change 4.6 % over the surface and 5.4 % at the patch" in said
    assert "not known" in tradeoff.facets(truth.iloc[:1].assign(geometry_of_peak=np.nan))
    assert page("tradeoff", found).count("flat facets") >= len(OWN)


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
    rows = settings[settings["scene"] == "liver_deep"]
    assert np.isnan(own_error(rows))
    text = " ".join(page("tradeoff", found).split())
    answer = text[text.index("[answer best_models_liver_deep]") : text.index("What is compared")]
    assert f"Beware: {UNKNOWN} (12 presses without a truth: 12 the levels are too far apart)." in answer
    assert "failed" not in answer and "nan" not in answer and "itself is known to" not in answer
    advice = found["advice"].assign(reference_error=np.nan)
    lines = advice_list(advice[advice["scene"] == "liver_deep"])
    assert UNKNOWN in lines and "failed" not in lines and "nan" not in lines


def test_snaps_are_those_of_the_table(trade_off_tables):
    table = trade_off_tables["limit_points"]
    found = tradeoff.snaps(table)  # the contact whose equilibrium is lost counts, too
    assert (found["count"], found["every"]) == (2, 12)
    assert (found["first"]["pressure_of_young_before"], found["first"]["pressure_of_young_after"]) == (0.29, 0.31)
    assert tradeoff.snaps(table[table["body"] == "cylinder"]) == {"count": 0, "every": 6, "first": {}}


def written(folder, found, more=()):
    """Write the report of a run of the trade-off with these tables; return the page."""
    (folder / "tables").mkdir(parents=True)
    (folder / "figures").mkdir(exist_ok=True)
    for name, table in found.items():
        table.to_csv(folder / "tables" / f"{name}.csv", index=False)
    for name in [*FIGURES, *more, *(f"best_models_{scene}" for scene in OWN)]:
        for suffix in ("svg", "png"):
            (folder / "figures" / f"{name}.{suffix}").write_text(f'<svg width="9pt" height="9pt">{name}</svg>')
    report.write(folder, folder / "report.html", ["tradeoff"], more=[n for n in found if n in more])
    return (folder / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")


def test_the_report_shows_all_of_it(found, tmp_path):
    text = written(tmp_path, found)
    assert {name for name in FIGURES if f'<figure id="figure_{name}">' in text} == set(FIGURES)
    for kind in ("over the surface (RMSE)", "at the patch"):
        assert f"What to take by its error {kind}: the mean error, the bound" in text
    assert "<td>none</td>" in text
    assert "linear FEM + kernel ridge: 0.9 % (nine in ten below 1.8 %, 24 contacts, 44 presses) in 120 µs" in text
    assert "(slowest press 150 µs); prepared in 53 s, 22 MB" in text
    assert not re.search(r"\{[a-z_]+\}", text.split("</style>")[1].split("<script>")[0])
    first = text[: text.index("</header>")]
    assert "The hardest scene of this run is" in first and "<img" in first and "The <strong>error</strong>" in first
    bounds = text[text.index("90 % bounds of single answers") :]
    assert "one fine residual" in bounds[:4000] and "With 10 contacts" in text.replace("\n", " ")
    # each diagram has a small one for narrow screens
    assert text.count('<source media="(max-width: 44rem)"') == len(OWN)
    assert "limit points" not in text and "figure_limit_points" not in text


def test_engines_that_ran_elsewhere_have_a_part_of_their_own(found, tmp_path):
    row = dict.fromkeys(ANSWERS.columns, 0.1) | {"engine": "Elsewhere", "scene": "cylinder_large", "model": "Elsewhere"}
    answers = ANSWERS.frame([row | {"setting": "fine", "version": "1", "hardware": "a card", "law": "corotational"}])
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures/answers_cylinder_large.svg").write_text('<svg width="9pt" height="9pt"></svg>')
    (tmp_path / "figures/answers_cylinder_large.png").write_text("")
    text = written(tmp_path, found | {"answers": answers}, ["answers"])
    assert "Engines that ran elsewhere" in text and '<figure id="figure_answers_cylinder_large">' in text
    assert "Elsewhere" in text[text.index("figure_answers_cylinder_large") :]
    assert "Engines that ran elsewhere" not in written(tmp_path / "without", found)


def test_what_only_some_runs_have_is_shown_where_it_is(found, trade_off_tables, tmp_path):
    more = ["limit_points", "any_load"]
    text = written(tmp_path, found | {name: trade_off_tables[name] for name in more}, more)
    assert '<figure id="figure_limit_points">' in text and "contacts the dent snaps" in text
    assert '<figure id="figure_any_load">' in text and "Loads that nothing was prepared for" in text
    row = re.search(r"<tr><td[^>]*>cylinder large</td><td[^>]*>never prepared</td>(.*?)</tr>", text)
    cells = re.findall(r"<td[^>]*>(.*?)</td>", row[1])
    best = "quadratic elements (P2) (level=1, start=rest): 0.72 %, nine in ten below 3.3 % (9 contacts), in 195 ms"
    assert cells == [best, f"none; nearest {best}"]
    assert "What models refuse" in text and "the place is not prepared" in text


def test_a_limit_that_the_test_contacts_broke_is_marked_in_every_table(found, tmp_path):
    asked = (found["advice"]["max_error"] == 0.05) & (found["advice"]["error"] == "rms")
    found["advice"].loc[asked, "rmse_of_peak"] = 0.07
    assert written(tmp_path, found).count("beware: on the test contacts its error is larger than asked, 7 %") == 7


def test_answers_to_presses_without_a_truth_are_a_column_where_there_are_such(found):
    head = "presses without a truth answered"
    said = numbers("tradeoff", found)
    assert head not in said["described"] and all(head not in one["front"] for one in said["scenes"])
    settings = found["accuracy_vs_time"]
    here = settings["scene"] == "liver_deep"
    settings.loc[here, "rejected"] = 2
    settings.loc[here & (settings["model"] == "pod_rbf"), "rejected_answered"] = 1
    said = numbers("tradeoff", found)
    described = said["described"].set_index("model")[head]
    assert described["reduced basis"] == "5 of 10" and described["linear elements (P1)"] == "0 of 30"
    for one in said["scenes"]:
        assert (head in one["front"]) == (one["scene"] == "liver_deep")


def test_what_models_are_given_is_a_table(found):
    rows = tradeoff.given_table(found["accuracy_vs_time"]).set_index("is given")
    assert set(rows.index) == {"the load", "the load, at a contact that was prepared", "a coarse deformation only"}
    prepared = rows.loc["the load, at a contact that was prepared"]
    assert "linear fine FEM" in prepared["models"] and "warped Green" in prepared["models"]
    assert prepared["least RMSE"].replace("\u00a0", " ") == "0.6 % to 1.6 %"
    assert "paper 1's blends, the best of twelve" in rows.loc["a coarse deformation only", "models"]
    assert not rows["models"].str.contains("no displacement").any()


def test_every_variant_is_in_its_table(found):
    rows = tradeoff.variants_table(found["accuracy_vs_time"])
    assert len(rows) == 16 and "contact-ordered, non-negative (a)" in set(rows["variant"])
    without = found["accuracy_vs_time"][~found["accuracy_vs_time"]["model"].str.contains("ordered_|framed_|springs")]
    assert tradeoff.variants_table(without).empty


def test_settings_that_failed_are_listed(found):
    settings = found["accuracy_vs_time"]
    settings["failure"] = settings["failure"].where(settings["failures"] == 0, "no way down")
    failed = list(tradeoff.failures(material("tradeoff", found)))
    assert failed[0] == (
        "linear elements (P1) (level=1, start=rest, tolerance=1e-08)",
        "cylinder, small loads",
        "2 of 15 test samples: no way down",
    )
    assert len(failed) == 30 and not np.isin(failed, ["nan"]).any()


def test_every_model_is_described():
    described = [name for family in FAMILIES for name in family["names"]]
    assert len(described) == len(set(described))
    assert set(MODELS) | set(RESERVED) <= set(described)
    assert all({"family", "short", "what", "before", "setting"} <= set(family) for family in FAMILIES)


def models(names):
    measured = pd.DataFrame({"model": names, "setting": [f"k={i}" for i in range(len(names))]})
    measured = measured.assign(rejected=0, rejected_answered=0)
    return tradeoff.models_table(measured, FAMILIES).set_index("model")


def test_families_of_which_nothing_was_measured_are_left_out_and_an_own_model_has_a_row():
    rows = models(["fem_p1", "fem_p1", "springs", "springs_nodal", "pod_rbf"])
    assert set(rows.index) == {"linear elements (P1)", "mass-spring", "reduced basis"}
    assert rows.loc["linear elements (P1)", ["variants", "settings of each"]].tolist() == [1, 2]
    assert rows.loc["mass-spring", ["variants", "settings of each"]].tolist() == [2, 1]
    assert models(["pod_rbf", "mine"]).loc["mine", "what it does"] == "a model of your own"
