"""Sentences about models in motion follow from their table."""

import numpy as np
import pandas as pd
from fixtures.material import failures, numbers, page

from palpate.benchmark.advice import ADVICE as ADVICE_TABLE
from palpate.benchmark.advice import advise_motion
from palpate.studies.dynamic.reference import MOTION_TRUTH

ADVICE = ADVICE_TABLE.frame([])


def test_the_finding_is_about_models_in_real_time(dynamic_table):
    tables = {"dynamic_accuracy": dynamic_table, "advice": ADVICE}
    best = numbers("dynamic", tables)["best"]
    assert best[["model", "rmse_of_peak"]].to_numpy().tolist() == [["springs", 0.04]] * 2
    slow = page("dynamic", tables | {"dynamic_accuracy": dynamic_table.assign(real_time_factor=2.0)})
    assert "In none of 2 scenes a model runs in real time" in slow


def test_no_error_is_quoted_where_meshes_part_at_once(dynamic_table):
    parts = dynamic_table["scene"] == "bar_sag"
    table = dynamic_table.assign(parted=np.where(parts, "two meshes agree at no time: 25 mm and 44 mm", ""))
    found = numbers("dynamic", {"dynamic_accuracy": table, "advice": ADVICE})["best"]
    assert found["scene"].tolist() == ["liver_press"]
    text = page("dynamic", {"dynamic_accuracy": table, "advice": ADVICE})
    assert "No error is known of bar sag, as two meshes agree at no time: 25 mm and 44 mm." in text
    for asked in ({"budgets_ms": [1000]}, {"speeds": [1]}, {"max_errors": [0.5]}):
        advice = advise_motion(table[parts], **asked).iloc[0]
        assert advice["model"] == "none" and np.isnan(advice["rmse_of_peak"]) and "44 mm" in advice["why"]


def test_a_standard_whose_error_other_meshes_say_is_told(dynamic_table):
    table = dynamic_table.assign(reference_error=[0.041] * 5 + [np.nan] * 5)
    assert numbers("dynamic", {"dynamic_accuracy": table, "advice": ADVICE})["unknown_meshes"] == ["bar sag"]
    advice = advise_motion(table[table["scene"] == "liver_press"], max_errors=[0.05, 0.09])
    # springs are 4 % from it
    assert advice["model"].tolist() == ["none", "springs"] and (advice["reference_error"] == 0.041).all()


def test_the_error_of_the_standards_mesh_is_said_where_presses_show_it(dynamic_table):
    table = dynamic_table.assign(body="liver")
    unknown = numbers("dynamic", {"dynamic_accuracy": table, "advice": ADVICE})["unknown_meshes"]
    assert unknown == ["liver press", "bar sag"]
    rows = [
        ("liver_small", "level=0, start=rest, tolerance=1e-08", 0.16, 0.33),
        ("liver_small", "level=1, start=rest, iterations=1", 0.30, 0.40),
        ("liver_small", "level=1, start=rest, tolerance=0.001", 0.20, 0.30),
        ("liver_small", "level=1, start=rest, tolerance=1e-08", 0.08, 0.17),
        ("liver_large", "level=1, start=rest, tolerance=1e-08", 0.10, 0.14),
    ]
    pressed = pd.DataFrame(rows, columns=["scene", "setting", "rmse_of_peak", "patch_rms_of_peak"])
    table.loc[table["scene"] == "bar_sag", "body"] = "bar"
    pressed = pressed.assign(model="fem_p1", body="liver")
    tables = {"dynamic_accuracy": table, "accuracy_vs_time": pressed, "advice": ADVICE}
    text = " ".join(page("dynamic", tables).split())
    assert "of liver press (liver, level 1) 8 % to 10 % of the peak, at the patch 14 % to 17 %" in text
    assert "not known of bar sag." in text


def test_scenes_with_a_truth_are_told_from_those_with_a_standard(dynamic_table):
    table = dynamic_table.copy()
    table.loc[table["scene"] == "liver_press", ["reference", "reference_error"]] = "fem_p2", 0.001
    tables = {
        "dynamic_accuracy": table,
        "advice": ADVICE,
        "motion_truth": MOTION_TRUTH.frame([{"scene": "liver_press"}]),
    }
    text = " ".join(page("dynamic", tables).split()).replace("\xa0", " ")
    assert "Errors are from the truth in liver press (0.1 %)," in text and "In the other scenes they are from a" in text
    assert numbers("dynamic", tables)["unknown_meshes"] == ["bar sag"]
    text = " ".join(page("dynamic", {"dynamic_accuracy": dynamic_table, "advice": ADVICE}).split())
    assert "from the truth in" not in text and "Errors are from a standard" in text


def test_a_motion_that_stopped_has_failed(dynamic_table):
    failed = failures("dynamic", {"dynamic_accuracy": dynamic_table})
    assert failed[0] == ("springs (step_s=0.0005)", "liver press", "did not reach the end") and len(failed) == 2


def test_scenes_without_a_truth_say_until_when_meshes_agree(dynamic_table):
    row = dict.fromkeys(MOTION_TRUTH.columns, 0.0) | {"elements": "linear", "rejected": "linear elements alone"}
    rows = [
        row | {"scene": "liver_press", "until_s": 0.28, "rmse_of_peak": 0.024},
        row | {"scene": "bar_sag", "until_s": 0.0, "rmse_of_peak": 0.028, "patch_rms_of_peak": 0.15},
    ]
    advice = [advise_motion(rows, [16.7], [0.1]) for _, rows in dynamic_table.groupby("scene", sort=False)]
    tables = {"dynamic_accuracy": dynamic_table, "advice": pd.concat(advice, ignore_index=True)}
    text = " ".join(page("dynamic", tables | {"motion_truth": pd.DataFrame(rows)}).split()).replace("\u00a0", " ")
    assert "liver press until 0.28 s (2.4 %), bar sag at no time (2.8 %, where it is pressed 15 %)" in text
