"""Tables and numbers about accuracy and time follow from the tables."""

import re

import numpy as np
import pandas as pd
import pytest
from fixtures.material import STUDIES, material, numbers, page
from fixtures.trade_off import OWN, accuracy_vs_time

from palpate.files import read_yaml
from palpate.models.model_registry import MODELS, RESERVED
from palpate.report import page as report
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
    assert [text.replace("\u00a0", " ") for text in said["truth_errors"]] == ["0.06 % to 0.41 %", "0.1 % to 0.8 %"]
    text = " ".join(page("tradeoff", found).split())
    assert "Within 0.0001 ms, no model in 6 of 6 scenes;" in text
    assert "within 1 ms, linear FEM + kernel ridge in 6 of 6 scenes (error 0.9 % to 2.3 %)" in text


def test_splits_are_counted_with_their_spread(found):
    said = numbers("tradeoff", found | {"accuracy_vs_time": accuracy_vs_time((1, 2, 3))})
    assert said["splits"] == 3 and 1.1 < said["spread"] < 1.5 and said["settings"] == 135


def test_the_answer_says_how_far_away_the_truth_is_how_well_it_is_known_and_the_dent(found):
    settings = found["accuracy_vs_time"]
    settings.loc[settings["scene"] == "liver_deep", "online_median_s"] *= 2
    text = " ".join(page("tradeoff", found).split())
    answer = text[text.index("[answer best_models_liver_deep]") : text.index("**Within")]
    assert "liver under deep loads: one answer of quadratic elements (P2) on its finest mesh takes 5.38 s." in answer
    assert (
        "known to 0.15 % of the peak over the surface, and to 0.6 % in the dent under the disc of 12 mm radius (0.38 % "
        "and 1.5 % where settings are chosen)."
    ) in answer
    assert "In the dent itself, the advised model has 7.8 % within 1 ms (warped Green's functions), 5.8 % wit" in answer
    assert "Within 1 ms (fast enough for force feedback to a hand), take linear FEM + ker" in answer
    assert (
        "none is sure to be (quadratic elements (P2): 0.8 % on test, 0.82 % on validation; the truth: 0.15 %)."
        in answer
    )


def test_the_answer_says_if_an_error_is_larger_on_test_contacts(found):
    advice = found["advice"]
    asked = (advice["max_error"] == 0.05) & (advice["error"] == "rms")
    advice.loc[asked, "rmse_of_peak"] = 0.07
    assert "on the test contacts its error is larger than asked, 7 %)" in page("tradeoff", found)


def test_snaps_are_those_of_the_table(trade_off_tables):
    table = trade_off_tables["limit_points"]
    found = tradeoff.snaps(table)  # the contact whose equilibrium is lost counts, too
    assert (found["count"], found["every"]) == (2, 12)
    assert (found["first"]["pressure_of_young_before"], found["first"]["pressure_of_young_after"]) == (0.29, 0.31)
    assert tradeoff.snaps(table[table["body"] == "cylinder"]) == {"count": 0, "every": 6, "first": {}}


def written(folder, found, more=()):
    """Write the report of a run of the trade-off with these tables; return the page."""
    (folder / "tables").mkdir(parents=True)
    (folder / "figures").mkdir()
    for name, table in found.items():
        table.to_csv(folder / "tables" / f"{name}.csv", index=False)
    for name in [*FIGURES, *more, *(f"best_models_{scene}" for scene in OWN)]:
        for suffix in ("svg", "png"):
            (folder / "figures" / f"{name}.{suffix}").write_text(f"<svg>{name}</svg>")
    report.write(folder, folder / "report.html", ["tradeoff"], more=[n for n in found if n in more])
    return (folder / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")


def test_the_report_shows_all_of_it(found, tmp_path):
    text = written(tmp_path, found)
    assert {name for name in FIGURES if f'<figure id="figure_{name}">' in text} == set(FIGURES)
    for kind in ("over the surface (RMSE)", "at the patch"):
        assert f"Least error {kind}, that error, and the time at the 95th percentile" in text
    assert "<td>none</td>" in text and "linear FEM + kernel ridge: 0.9 % in 150 µs" in text
    assert "warped Green&#x27;s functions: 3.9 % in 375 µs" in text
    assert not re.search(r"\{[a-z_]+\}", text.split("</style>")[1].split("<script>")[0])
    first = text[: text.index("</header>")]
    assert "The hardest scene of this run is" in first and "<img" in first and "The <strong>error</strong>" in first
    bounds = text[text.index("90 % bounds of single answers") :]
    assert "one fine residual" in bounds[:4000] and "With 10 contacts" in text.replace("\n", " ")
    # each diagram has a small one for narrow screens
    assert text.count('<source media="(max-width: 44rem)"') == len(OWN)
    assert "limit points" not in text and "figure_limit_points" not in text


def test_what_only_some_runs_have_is_shown_where_it_is(found, trade_off_tables, tmp_path):
    text = written(tmp_path, found | {"limit_points": trade_off_tables["limit_points"]}, more=["limit_points"])
    assert '<figure id="figure_limit_points">' in text and "contacts the dent snaps" in text


def test_loads_that_nothing_was_prepared_for_are_shown_where_they_were_asked(found, trade_off_tables, tmp_path):
    text = written(tmp_path, found | {"any_load": trade_off_tables["any_load"]}, more=["any_load"])
    assert '<figure id="figure_any_load">' in text and "Loads that nothing was prepared for" in text
    row = re.search(r"<tr><td[^>]*>cylinder large</td><td[^>]*>never prepared</td>(.*?)</tr>", text)
    cells = re.findall(r"<td[^>]*>(.*?)</td>", row[1])
    assert cells == ["quadratic elements (P2) (level=1, start=rest): 0.72 %, at most 1.1 %, in 180 ms", "none"]
    assert "What models refuse" in text and "the place is not prepared" in text


def test_with_several_splits_advice_says_in_how_many_it_is_the_same(found, trade_off_tables, tmp_path):
    first, second = found["advice"], found["advice"].assign(split=2)
    second.loc[second["model"] == "linear_residual", ["model", "setting"]] = ["linear_fem", "default"]
    several = {"advice": pd.concat([first, second]), "advice_agreement": trade_off_tables["advice_agreement"]}
    text = written(tmp_path, found | several, more=["advice_agreement"])
    assert "0.9 % in 150 µs (1 of 2 splits)" in text and "2 of 2 splits" not in text
    assert "splits advise the same model on average" in text


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
    return tradeoff.models_table(measured, FAMILIES).set_index("model")


def test_families_of_which_nothing_was_measured_are_left_out():
    rows = models(["fem_p1", "fem_p1", "springs", "springs_nodal", "pod_rbf"])
    assert set(rows.index) == {"linear elements (P1)", "mass-spring", "reduced basis"}
    assert rows.loc["linear elements (P1)", ["variants", "settings of each"]].tolist() == [1, 2]
    assert rows.loc["mass-spring", ["variants", "settings of each"]].tolist() == [2, 1]


def test_an_own_model_has_a_row():
    assert models(["pod_rbf", "mine"]).loc["mine", "what it does"] == "a model of your own"
