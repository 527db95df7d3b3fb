"""Splits that agree are counted, and flips with the finger's radius are found."""

import numpy as np
import pandas as pd
from palpate.studies.tradeoff.advice_words import agreement_words

from palpate.benchmark.advice import AGREEMENT_COLUMNS, RADIUS_COLUMNS, agreed, agreement, by_radius


def row(scene, model, error=0.01, setting="k=1", split=1, kind="rms", budget=1.0, limit=np.nan) -> dict:
    found = {"scene": scene, "error": kind, "split": split, "budget_ms": budget, "max_error": limit}
    return found | {"model": model, "setting": setting, "rmse_of_peak": error, "patch_rms_of_peak": 3 * error}


def test_splits_that_agree_are_counted():
    advice = pd.DataFrame(
        [
            row("liver_small", "a", 0.01, split=1),
            row("liver_small", "a", 0.03, "k=2", split=2),
            row("liver_small", "b", 0.02, split=3),
            row("liver_small", "a", 0.02, split=4),
            row("liver_small", "none", np.nan, np.nan, split=5),
            *(row("liver_small", "c", 0.05, split=s, kind="patch") for s in range(1, 6)),
            *(row("liver_small", "b", split=s, budget=np.nan, limit=0.05) for s in range(1, 6)),
            row("bar_sag", "a", split=0),
        ]
    )
    found = agreement(advice, {"liver_small": ("liver", "small")})
    assert found.columns.tolist() == AGREEMENT_COLUMNS and len(found) == 3
    first, patch, limit = found.itertuples()
    assert (first.model, first.setting, first.splits, first.same, first.same_setting) == ("a", "k=1", 5, 3, 2)
    assert first.others == "b 1, none 1" and (first.body, first.regime, first.error) == ("liver", "small", "rms")
    assert np.isclose(first.rmse_of_peak, 0.02) and (first.least, first.most) == (0.01, 0.03)
    assert (patch.error, patch.same, patch.others) == ("patch", 5, "") and np.isclose(patch.most, 0.15)
    assert np.isnan(limit.budget_ms) and limit.max_error == 0.05 and limit.same == 5


def test_it_is_found_where_advice_flips_with_the_radius():
    scenes = [("liver_radius_12", "b"), ("liver_radius_4", "a"), ("liver_radius_20", "b"), ("liver_radius_8", "a")]
    advice = pd.DataFrame(
        [
            *(row(scene, model) for scene, model in scenes),
            *(row(scene, model, kind="patch") for scene, model in zip(dict(scenes), "bbbb", strict=True)),
            row("liver_small", "c"),
        ]
    )
    radii = {scene: ("liver", float(scene.split("_")[-1]) / 1000) for scene, _ in scenes}
    found = by_radius(advice, radii)
    assert found.columns.tolist() == RADIUS_COLUMNS and len(found) == 8
    rms = found[found["error"] == "rms"]
    assert rms["radius_m"].tolist() == [0.004, 0.008, 0.012, 0.02] and rms["model"].tolist() == list("aabb")
    assert rms["flips"].tolist() == [False, False, True, False]
    assert not found.loc[found["error"] == "patch", "flips"].any()
    assert by_radius(advice, {}).columns.tolist() == RADIUS_COLUMNS


def test_agreeing_on_nothing_is_no_agreement():
    """Where no model is advised, as none is exact enough, all splits say so, and that is not what is asked."""
    table = pd.DataFrame({"model": ["a", "b", "none", "none"], "same": [5, 2, 5, 5], "splits": 5})
    assert agreed(table) == (0.7, 0.5, 2)
    assert agreement_words(table).replace("\u00a0", " ") == (
        "Of the 2 questions that have an answer, 3.5 of 5 splits advise the same model on average, and all of them in "
        "50 %."
    )
