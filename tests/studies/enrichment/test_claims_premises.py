"""Verdicts on features follow from the tables, and a failure outside the premise is called so."""

import pandas as pd
import pytest

from palpate.report.claims import CONFIRMED, OUTSIDE, REFUTED
from palpate.studies.enrichment import claims


def tables(body="cylinder", moved=0.1, ratio=0.5, width=0.1, few=0.05):
    rows = []
    for train, errors in ((18, {"unordered": 0.1, "ordered": 0.1 * ratio}), (6, {"unordered": 0.3, "ordered": few})):
        for features, error in errors.items():
            low, high = ratio * (1 - width), ratio * (1 + width)
            rows.append(["p", "contacts", train, features, "nonnegative_a", error, 9.0, 9.0, 9.0])
            if train == 18:
                rows.append(["p", "samples", train, features, "nonnegative_a", error, ratio, low, high])
            rows.append(["p", "contacts", train, features, "literal", 9.0, 9.0, 9.0, 9.0])
    names = ["premise", "held_out", "train", "features", "weights", "rmse_of_peak", "ratio", "ratio_low", "ratio_high"]
    about = [["p", body, "linear", "solid", "otherwise", 20, moved]]
    memory = [["cylinder", "unordered", 100.0, 900.0], ["cylinder", "ordered", 10.0, 950.0], ["p", "ordered", 1.0, 1.0]]
    return {
        "premises": pd.DataFrame(rows, columns=names),
        "premise_bodies": pd.DataFrame(
            about, columns=["premise", "body", "responses", "made_of", "held", "contacts", "moved_share"]
        ),
        "database_memory": pd.DataFrame(memory, columns=["premise", "features", "features_kb", "total_kb"]),
    }


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, CONFIRMED),
        ({"ratio": 0.85}, REFUTED),  # better, but not clearly
        ({"ratio": 0.75}, CONFIRMED),
        ({"ratio": 0.75, "width": 0.4}, REFUTED),  # clearly, but not certainly
        ({"ratio": 2.0}, REFUTED),
        ({"ratio": 2.0, "moved": 0.9}, OUTSIDE),
        ({"ratio": 2.0, "moved": 0.35}, OUTSIDE),
        ({"ratio": 0.5, "moved": 0.9}, CONFIRMED),
        ({"ratio": 1.3, "body": "liver"}, CONFIRMED),
        ({"ratio": 2.0, "body": "liver"}, REFUTED),
        ({"ratio": 0.5, "body": "liver"}, CONFIRMED),
        ({"ratio": 1.1, "body": "pad"}, REFUTED),
    ],
)
def test_errors_are_judged_by_their_interval_and_the_premise(changes, verdict):
    first, *_ = claims.premises(tables(**changes))
    assert first.verdict == verdict and first.paper == 1
    assert first.ours.endswith("9.00 [9.00, 9.00] with contacts held out")


@pytest.mark.parametrize(("few", "verdict"), [(0.09, CONFIRMED), (0.11, REFUTED)])
def test_fewer_samples_have_to_reach_the_error_of_all(few, verdict):
    found = list(claims.premises(tables(few=few)))[1]
    assert found.verdict == verdict and "with 6 samples" in found.ours and "with 18" in found.ours


def test_memory_is_less_for_features_and_more_in_all():
    features, total = list(claims.premises(tables()))[2:]
    assert (features.verdict, total.verdict) == (CONFIRMED, REFUTED)
    assert features.ours == "10 kB against 100 kB" and total.premise == "cylinder: all that a query may need"


def test_speed_counts_the_coarse_simulation_too():
    timing = pd.DataFrame(
        [
            ["liver", "fine_fem", 0.5, 49.292], ["liver", "contact_ordered", 1e-4, 0.128],
            ["liver", "detail_correction", 1e-3, float("nan")], ["liver", "live_all_in", 6e-3, float("nan")],
            ["own", "fine_fem", 0.5, float("nan")], ["own", "contact_ordered", 1e-4, float("nan")],
            ["own", "detail_correction", 1e-3, float("nan")], ["own", "live_all_in", 6e-3, float("nan")],
        ],
        columns=["body", "method", "mean_s", "paper_mean_s"],
    )  # fmt: skip
    alone, whole = claims.speed({"enrichment_timing": timing})
    assert (alone.published, alone.ours, alone.verdict) == ("385 times", "5000 times", CONFIRMED)
    assert (whole.ours, whole.verdict) == ("98 times", REFUTED)
