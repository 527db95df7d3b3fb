"""Sentences, tables and captions about accuracy and time follow from the tables."""

import re

import numpy as np
import pandas as pd
import pytest
from fixtures.material import CAPTIONS, material, numbers

from palpate.figures import tables
from palpate.files import read_yaml
from palpate.models.model_registry import MODELS, RESERVED
from palpate.report import page as report
from palpate.report.advice_words import sentence
from palpate.report.parts import tradeoff

FAMILIES = read_yaml(CAPTIONS / "tradeoff/models.yaml")


@pytest.fixture
def liver(advised_tables):
    return [tables.where(table, scene="liver_small") for table in advised_tables]


@pytest.fixture
def found(advised_tables):
    return dict(zip(("accuracy_vs_time", "advice"), advised_tables, strict=True))


def test_sentences_name_model_error_time_and_rival(liver):
    _, advised = liver
    said = [sentence(row).replace("\u00a0", " ") for _, row in advised.iterrows()]
    assert said[0].startswith("Within 0.01 ms: none, because the fastest setting, linear fine FEM, takes 0.012 ms")
    assert said[1].startswith("Within 1 ms: linear fine FEM. Its error is 5 % (")
    assert said[1].endswith(
        "which leaves 99 % of the time. The next best model, shape matching (steps=30), has 4 times the error."
    )
    assert "error is 0.4 % (" in said[2] and "its time 6 ms at the 95th percentile, which leaves 64 %" in said[2]
    assert "has 200 times the error" in said[3]
    assert said[4].startswith("Error of at most 5 %: corrected coarse FEM (samples=60)")
    assert "The next best model, POD + RBF (modes=8), is about as fast. The error of the mesh itself, 0.6 %," in said[4]


def test_sentences_say_what_was_passed_over_and_what_is_added(liver):
    row = liver[1].iloc[1].copy()
    row[["faster", "faster_setting", "faster_error", "faster_high", "faster_factor"]] = (
        "pod_rbf",
        "modes=8",
        0.02,
        0.06,
        33,
    )
    row["reference_error"] = 0.16
    assert (
        sentence(row)
        .replace("\u00a0", " ")
        .endswith(
            "POD + RBF (modes=8) is 33 times as fast and was passed over, as its error of 2 % may be up to 6 %. "
            "Refine the mesh: its own error, 16 %, is larger and not included."
        )
    )
    row[["error_low", "error_high", "faster_factor", "budget_ms"]] = np.nan
    row[["reference_error", "max_error"]] = 0.0023, 0.1
    assert (
        sentence(row).replace("\u00a0", " ").endswith("The error that is judged includes the reference's own, 0.23 %.")
    )


def test_captions_get_their_numbers(found):
    said = numbers("tradeoff", found)
    assert (said["tradeoff_models"], said["tradeoff_settings"]) == ("7", "16")
    assert said["tradeoff_failures"].startswith("2 failed on at least one sample")
    assert said["tradeoff_truth"] == "0.6 % (liver, small loads); 6 % (own, large loads)"
    assert "within 1 ms, linear fine FEM in 2 of 2 scenes (error 5 % to 50 %)" in said["headline"]
    assert said["headline"].startswith("Within 0.01 ms, no model in 2 of 2 scenes;")


def test_the_answer_is_about_the_scene_that_takes_the_fine_simulation_longest(found):
    settings = found["accuracy_vs_time"].copy()
    settings.loc[settings["scene"] == "own_large", "online_median_s"] *= 2
    said = numbers("tradeoff", found | {"accuracy_vs_time": settings})
    assert said["picture"] == "best_models_own_large" and said["hardest"] == "own, large loads"
    first, none, fast, *_, accurate, mesh = said["answer"].split("\n")
    assert first == (
        "The hardest scene of this run is the own under large loads: one answer of the fine simulation takes 800 ms."
    )
    assert none == "Within 0.01 ms, no model answers in time."
    assert fast.startswith(
        "Within 1 ms (fast enough for force feedback to a hand), take linear fine FEM (stored responses of the fine "
        "mesh to unit forces): its error is 50 %, its time 20 µs; the next best model, shape matching, has 4 times "
        "the error."
    )
    assert accurate.startswith("For an error of at most 5 %, take ")
    assert mesh == "The mesh itself has an error of 6 %: to get below that, refine it first."


def test_budgets_with_the_same_answer_share_a_sentence(found):
    advice = found["advice"]
    row = advice[(advice["scene"] == "liver_small") & (advice["budget_ms"] == 16.7)]
    same = pd.concat([row, row.assign(budget_ms=100.0)])
    said = numbers("tradeoff", found | {"advice": same})["answer"].split("\n")
    assert len(said) == 3 and said[2].startswith("The mesh itself has an error of 0.6 %")
    assert said[1].startswith("Within 16.7 ms (one picture at 60 a second) and 100 ms (still felt as immediate), take")


def test_the_report_shows_all_of_it(found, tmp_path):
    (tmp_path / "tables").mkdir()
    (tmp_path / "figures").mkdir()
    for name, table in found.items():
        table.to_csv(tmp_path / "tables" / f"{name}.csv", index=False)
    scenes = ("liver_small", "own_large")
    names = [*(f"work_precision_{scene}" for scene in scenes), "advice", "break_even"]
    for name in [*names, *(f"best_models_{scene}" for scene in scenes)]:
        for suffix in ("svg", "png"):
            (tmp_path / "figures" / f"{name}.{suffix}").write_text(f"<svg>{name}</svg>")
    report.write(tmp_path, CAPTIONS, tmp_path / "report.html", ["tradeoff"])
    page = (tmp_path / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert {name for name in names if f'<figure id="figure_{name}">' in page} == set(names)
    assert "<li>Within 1 ms: linear fine FEM. Its error is 5 %" in page
    table = page[page.index("What to take, its error") :]
    assert "<td>none</td>" in table and "corrected coarse FEM (samples=60): 0.4 % in 6 ms" in table
    assert not re.search(r"\{[a-z_]+\}", page.split("</style>")[1].split("<script>")[0])
    first = page[: page.index("</header>")]
    assert "The hardest scene of this run is" in first and "<img" in first and "The <strong>error</strong>" in first
    # each diagram has a small one for narrow screens
    assert page.count('<source media="(max-width: 44rem)"') == 2


def test_settings_that_failed_are_listed(found):
    settings = found["accuracy_vs_time"].copy()
    settings["failure"] = settings["failure"].where(settings["failures"] == 0, "no way down")
    failed = list(tradeoff.failures(material("tradeoff", found | {"accuracy_vs_time": settings})))
    assert failed[0] == ("springs (iterations=1)", "liver, small loads", "2 of 12 test samples: no way down")
    assert len(failed) == 2 and not np.isin(failed, ["nan"]).any()


def models(names):
    measured = pd.DataFrame({"model": names, "setting": [f"k={i}" for i in range(len(names))]})
    return tradeoff._models(material("tradeoff", {"accuracy_vs_time": measured}))


def test_every_model_is_described():
    described = [name for family in FAMILIES for name in family["names"]]
    assert len(described) == len(set(described))
    assert set(MODELS) | set(RESERVED) <= set(described)
    assert all({"family", "short", "what", "before", "setting"} <= set(family) for family in FAMILIES)


def test_families_of_which_nothing_was_measured_are_left_out():
    text = models(["fem_fine", "fem_fine", "fem_coarse", "pod_rbf"])
    assert ">finite elements (FEM)</td>" in text and "<td>reduced basis</td>" in text
    assert "mass-spring" not in text
    assert '<td class="number">2</td><td class="number">2</td>' in text  # two variants, of two settings at most


def test_an_own_model_has_a_row():
    assert '<td>mine</td><td class="mid">a model of your own</td>' in models(["pod_rbf", "mine"])
