"""Verdicts follow from the tables."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from palpate.evaluation.enrichment.complexity import OPERATIONS, complexity_rows
from palpate.evaluation.enrichment.enrichment_claims import claims
from palpate.files import read_yaml

PAPER = read_yaml(Path(__file__).parents[3] / "workflow/report/enrichment/published.yaml")


def accuracy(cylinder, liver):
    """Errors of ordered features; those of unordered ones are 0.1."""
    rows = []
    for body, ordered in (("cylinder", cylinder), ("liver", liver), ("own", 0.5)):
        for kind in ("nonnegative_a", "nonnegative_b"):
            for name, error in ((f"ordered_{kind}", ordered), (f"unordered_{kind}", 0.1)):
                for protocol in ("paper", "live"):
                    rows.append((body, "small", protocol, "samples", name, error if protocol == "paper" else 9.0))
    return pd.DataFrame(rows, columns=["body", "regime", "protocol", "split", "method", "rmse_of_peak"])


def sweep(best_of_size):
    rows = []
    for body in best_of_size:
        for sigma in 0.2 * np.geomspace(1e-3, 10, 41):
            error = 0.1 + np.log(sigma / (0.2 * best_of_size[body])) ** 2
            rows.append((body, "small", "paper", "samples", "ordered", "nonnegative_a", sigma, 5 * sigma, error))
    columns = [
        "body",
        "regime",
        "protocol",
        "split",
        "features",
        "weights",
        "sigma_m",
        "sigma_relative",
        "rmse_of_peak",
    ]
    return pd.DataFrame(rows, columns=columns)


def complexity(exponent_k):
    rows = [
        (name, r, k, 1e-9 * operation.grows(r, k) * k ** (exponent_k - (1 + name.startswith("building_"))))
        for name, operation in OPERATIONS.items()
        for r in operation.lengths
        for k in (25, 50, 100, 200)
    ]
    return complexity_rows(pd.DataFrame(rows, columns=["operation", "r", "k", "seconds"]))


def timing(ratio):
    rows = [
        ("liver", "unordered", ratio * 1e-4),
        ("liver", "contact_ordered", 1e-4),
        ("liver", "detail_correction", 1e-3),
    ]
    return pd.DataFrame(rows, columns=["body", "method", "mean_s"])


def verdicts(cylinder=0.05, liver=0.1, best=None, exponent=2.0, ratio=4.7):
    best = best or {"cylinder": 0.2, "liver": 0.2 / 6.48}
    table = claims(accuracy(cylinder, liver), sweep(best), complexity(exponent), timing(ratio), PAPER)
    assert table.columns.tolist() == ["claim", "paper", "measured", "verdict"]
    assert table["measured"].str.len().min() > 0
    return table.set_index("claim")["verdict"]


def find(found, *words):
    [verdict] = [v for claim, v in found.items() if all(word in claim for word in words)]
    return verdict


@pytest.mark.parametrize(("error", "wanted"), [(0.05, "confirmed"), (0.095, "refuted"), (0.3, "refuted")])
def test_ordered_is_better_on_the_cylinder(error, wanted):
    assert find(verdicts(cylinder=error), "clearly better", "cylinder") == wanted


@pytest.mark.parametrize(("error", "wanted"), [(0.11, "confirmed"), (0.09, "confirmed"), (0.2, "refuted")])
def test_ordered_is_on_a_par_on_the_liver(error, wanted):
    assert find(verdicts(liver=error), "on a par", "liver") == wanted


def test_sigma_is_compared_in_mesh_units():
    found = verdicts(best={"cylinder": 0.2, "liver": 0.2})
    assert find(found, "σ = 0.2", "cylinder") == "confirmed"
    assert find(found, "σ = 0.2", "liver") == "refuted"


def test_orders():
    found = verdicts(exponent=2.0)
    assert find(found, "inversion left out") == "confirmed"
    assert find(found, "sorting costs") == "refuted"
    assert find(verdicts(exponent=2.6), "inversion included") == "refuted"
    assert find(verdicts(exponent=1.0), "inversion included") == "true as a bound"


@pytest.mark.parametrize(
    ("ratio", "wanted"), [(4.0, "confirmed"), (5.5, "confirmed"), (1.2, "refuted"), (9, "refuted")]
)
def test_the_ratio_of_times(ratio, wanted):
    assert find(verdicts(ratio=ratio), "4.7 times") == wanted


def test_other_bodies_have_no_claims():
    assert not any("own" in claim for claim in verdicts().index)
