"""Tables and captions about accuracy and time follow from the tables."""

import re

import numpy as np
import pandas as pd
import pytest
from fixtures.material import STUDIES, material, numbers
from fixtures.trade_off import OWN, accuracy_vs_time
from palpate.studies.tradeoff.report_numbers import snaps

from palpate.files import read_yaml
from palpate.models.model_registry import MODELS, RESERVED
from palpate.report import page as report
from palpate.studies.tradeoff import report as tradeoff
from palpate.studies.tradeoff import report_models as tradeoff_models

FAMILIES = read_yaml(STUDIES / "tradeoff/captions/models.yaml")
FIGURES = ["advice", "break_even", "truth", "error_bounds", *(f"work_precision_{scene}" for scene in OWN)]


@pytest.fixture
def found(trade_off_tables):
    return {name: trade_off_tables[name].copy() for name in ("accuracy_vs_time", "advice", "truth", "error_bounds")}


def test_captions_get_their_numbers(found):
    said = numbers("tradeoff", found)
    assert (said["tradeoff_models"], said["tradeoff_settings"]) == (
        "13 methods (one in 12 variants, one in 4 variants)",
        "135",
    )
    assert said["tradeoff_failures"].startswith("30 failed on at least one sample")
    assert said["tradeoff_truth"] == "0.06 % to 0.41 % over the surface and 0.1 % to 0.8 % at the patch"
    assert said["tradeoff_splits"].startswith("one division") and said["tradeoff_samples"] == "15"
    assert said["headline"].startswith("Within 0.0001 ms, no model in 6 of 6 scenes;")
    assert "within 1 ms, linear FEM + kernel ridge in 6 of 6 scenes (error 0.9 % to 2.3 %)" in said["headline"]


def test_splits_are_counted_with_their_spread(found):
    said = numbers("tradeoff", found | {"accuracy_vs_time": accuracy_vs_time((1, 2, 3))})
    assert said["tradeoff_splits"].startswith("3 divisions of the contacts")
    assert 1.1 < float(re.search(r"factor of ([\d.]+) ", said["tradeoff_splits"])[1]) < 1.5
    assert said["tradeoff_settings"] == "135"


def test_the_answer_says_how_far_away_the_truth_is_how_well_it_is_known_and_the_dent(found):
    settings = found["accuracy_vs_time"]
    settings.loc[settings["scene"] == "liver_deep", "online_median_s"] *= 2
    said = numbers("tradeoff", found)
    assert said["picture"] == "best_models_liver_deep" and said["hardest"] == "liver, deep loads"
    first, *rest, dent, known = said["answer"].split("\n")
    assert first == (
        "The hardest scene of this run is the liver under deep loads: one answer of quadratic elements (P2) on its "
        "finest mesh takes 5.38 s."
    )
    assert known == (
        "The truth itself is known to 0.15 % of the peak displacement over the surface, and to 0.6 % in the dent under "
        "the disc of 12 mm radius (0.38 % and 1.5 % where settings are chosen)."
    )
    assert dent.startswith(
        "In the dent itself, the advised model has 7.8 % within 1 ms (warped Green's functions), 5.8 % wit"
    )
    assert any(
        line.startswith("Within 1 ms (fast enough for force feedback to a hand), take linear FEM + ker")
        for line in rest
    )
    last = next(line for line in rest if line.startswith("For an error of at most"))
    assert last.endswith(
        "none is sure to be (quadratic elements (P2): 0.8 % on test, 0.82 % on validation; the truth: 0.15 %)."
    )


def test_the_answer_says_if_an_error_is_larger_on_test_contacts(found):
    settings, advice = found["accuracy_vs_time"], found["advice"]
    asked = (advice["max_error"] == 0.05) & (advice["error"] == "rms")
    advice.loc[asked, "rmse_of_peak"] = 0.07
    said = numbers("tradeoff", {**found, "accuracy_vs_time": settings})["answer"]
    assert "on the test contacts its error is larger than asked, 7 %)" in said


def test_snaps_are_those_of_the_table(trade_off_tables):
    table = trade_off_tables["limit_points"]
    # the contact whose equilibrium is lost counts, too
    assert (
        snaps(table)
        .replace("\u00a0", " ")
        .startswith("At 2 of 12 contacts the dent snaps, first between 0.29 and 0.31 of Young's modulus, from ")
    )
    assert snaps(table[table["body"] == "cylinder"]) == (
        "At none of 6 contacts the dent grows much faster than the load."
    )


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
    page = written(tmp_path, found)
    assert {name for name in FIGURES if f'<figure id="figure_{name}">' in page} == set(FIGURES)
    for kind in ("over the surface (RMSE)", "at the patch"):
        assert f"What to take for the least error {kind}, that error, and the time at the 95th percentile" in page
    assert "<td>none</td>" in page and "linear FEM + kernel ridge: 0.9 % in 150 µs" in page
    assert "warped Green&#x27;s functions: 3.9 % in 375 µs" in page
    assert not re.search(r"\{[a-z_]+\}", page.split("</style>")[1].split("<script>")[0])
    first = page[: page.index("</header>")]
    assert "The hardest scene of this run is" in first and "<img" in first and "The <strong>error</strong>" in first
    bounds = page[page.index("90 % bounds of single answers") :]
    assert "one fine residual" in bounds[:4000] and "With 10 contacts" in page.replace("\n", " ")
    # each diagram has a small one for narrow screens
    assert page.count('<source media="(max-width: 44rem)"') == len(OWN)
    assert "limit points" not in page and "figure_limit_points" not in page


def test_what_only_some_runs_have_is_shown_where_it_is(found, trade_off_tables, tmp_path):
    page = written(tmp_path, found | {"limit_points": trade_off_tables["limit_points"]}, more=["limit_points"])
    assert '<figure id="figure_limit_points">' in page and "A finding about the corotational law" in page


def test_loads_that_nothing_was_prepared_for_are_shown_where_they_were_asked(found, trade_off_tables, tmp_path):
    page = written(tmp_path, found | {"any_load": trade_off_tables["any_load"]}, more=["any_load"])
    assert '<figure id="figure_any_load">' in page and "Loads that nothing was prepared for" in page
    row = re.search(r"<tr><td[^>]*>cylinder large</td><td[^>]*>never prepared</td>(.*?)</tr>", page)
    cells = re.findall(r"<td[^>]*>(.*?)</td>", row[1])
    assert cells == ["quadratic elements (P2) (level=1, start=rest): 0.72 %, at most 1.1 %, in 180 ms", "none"]
    assert "What models refuse" in page and "the place is not prepared" in page


def test_with_several_splits_advice_says_in_how_many_it_is_the_same(found, trade_off_tables, tmp_path):
    first, second = found["advice"], found["advice"].assign(split=2)
    second.loc[second["model"] == "linear_residual", ["model", "setting"]] = ["linear_fem", "default"]
    several = {"advice": pd.concat([first, second]), "advice_agreement": trade_off_tables["advice_agreement"]}
    page = written(tmp_path, found | several, more=["advice_agreement"])
    assert "0.9 % in 150 µs (1 of 2 splits)" in page and "2 of 2 splits" not in page
    assert "The contacts were divided in several ways" in page


def test_what_models_are_given_is_a_table(found):
    text = tradeoff_models.given_table(found["accuracy_vs_time"]).replace("\u00a0", " ")
    rows = re.findall(r"<tr><td.*?</tr>", text)
    cells = {re.sub("<.*?>", "|", row).strip("|").split("||")[0]: row for row in rows}
    assert set(cells) == {"the load", "the load, at a contact that was prepared", "a coarse deformation only"}
    prepared = cells["the load, at a contact that was prepared"]
    assert "linear fine FEM" in prepared and "warped Green" in prepared and "0.6 % to 1.6 %" in prepared
    assert "paper 1&#x27;s blends, the best of twelve" in cells["a coarse deformation only"]
    assert "zero" not in text and "no displacement" not in text


def test_every_variant_is_in_its_table(found):
    text = tradeoff_models.variants_table(found["accuracy_vs_time"])
    assert text.count("<tr>") == 17 and "contact-ordered, non-negative (a)" in text
    without = found["accuracy_vs_time"][~found["accuracy_vs_time"]["model"].str.contains("ordered_|framed_|springs")]
    assert tradeoff_models.variants_table(without) == ""


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


def models(names):
    measured = pd.DataFrame({"model": names, "setting": [f"k={i}" for i in range(len(names))]})
    return tradeoff_models.models_table(material("tradeoff", {"accuracy_vs_time": measured}))


def test_every_model_is_described():
    described = [name for family in FAMILIES for name in family["names"]]
    assert len(described) == len(set(described))
    assert set(MODELS) | set(RESERVED) <= set(described)
    assert all({"family", "short", "what", "before", "setting"} <= set(family) for family in FAMILIES)


def test_families_of_which_nothing_was_measured_are_left_out():
    text = models(["fem_p1", "fem_p1", "springs", "springs_nodal", "pod_rbf"])
    assert ">linear elements (P1)</td>" in text and "<td>reduced basis</td>" in text
    assert "shape matching" not in text
    assert '<td class="number">1</td><td class="number">2</td>' in text  # one variant, of two settings
    assert '<td class="number">2</td><td class="number">1</td>' in text  # two variants, of one setting each


def test_an_own_model_has_a_row():
    assert '<td>mine</td><td class="mid">a model of your own</td>' in models(["pod_rbf", "mine"])
