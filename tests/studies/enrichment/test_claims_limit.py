"""The limit that paper 1 names, and its kernel, are judged over the premises."""

import pandas as pd

from palpate.report.claims import CONFIRMED, REFUTED
from palpate.studies.enrichment.claims import limit


def judged(moved=(0.1, 0.4, 0.8), linear=2.0):
    rows = [
        (premise, "contacts", train, features, weights, factor * error * 18 / train)
        for premise, error in (("bedded", 0.05), ("held", 0.1), ("bent", 0.4))
        for train in (6, 18)
        for features in ("ordered", "unordered")
        for weights, factor in (("nonnegative_a", 1.0), ("linear", linear))
    ]
    names = ["premise", "held_out", "train", "features", "weights", "rmse_of_peak"]
    bodies = pd.DataFrame({"premise": ["bedded", "held", "bent"], "moved_share": moved})
    return list(limit({"premises": pd.DataFrame(rows, columns=names), "premise_bodies": bodies}))


def test_errors_that_rise_with_what_moves_confirm_the_limit():
    limit, kernel, _ = judged()
    assert limit.verdict == kernel.verdict == CONFIRMED
    assert limit.ours.startswith("5 % of the peak where 10 % of the surface moves, 40 % of the peak where 80 %")
    assert judged(moved=(0.8, 0.4, 0.1))[0].verdict == REFUTED


def test_a_kernel_that_is_worse_than_the_linear_regressor_is_refuted():
    for kernel in judged(linear=0.5)[1:]:
        assert (kernel.verdict, kernel.ours.split(",")[0]) == (REFUTED, "2 times its error in the geometric mean")
