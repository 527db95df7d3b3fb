"""Sentences about models in motion follow from their table."""

import numpy as np
from fixtures.material import numbers, page

from palpate.benchmark.advice import ADVICE as ADVICE_TABLE
from palpate.benchmark.advice import advise_motion

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
