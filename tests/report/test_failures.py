"""Whatever failed is listed, with where and how."""

import numpy as np
import pandas as pd

from palpate.report.failures import failures


def test_methods_without_an_answer(results):
    found = failures({"enrichment_accuracy": results["enrichment_accuracy"]})
    assert set(found["what"]) == {"POD + RBF"} and len(found) == 8
    assert found["where"].iloc[0] == "own, small loads, paper protocol, samples held out"


def test_failed_samples_and_hard_cases():
    settings = pd.DataFrame(
        {
            "scene": "liver_large",
            "model": ["fem_fine", "mine"],
            "setting": ["tolerance=1e-08", "default"],
            "samples": 45,
            "failures": [2, 0],
            "failure": ["no way down", ""],
        }
    )
    cases = pd.DataFrame({"case": ["sliver", "flat"], "model": "fem", "outcome": ["stable", "not_converged"]})
    found = failures({"accuracy_vs_time": settings, "hard_cases": cases}).to_numpy().tolist()
    assert found == [
        ["accuracy and time", "fine FEM (tolerance=1e-08)", "liver_large", "2 of 45 test samples: no way down"],
        ["hard cases", "fem", "flat", "not converged"],
    ]


def test_nothing_failed(results, collision_results):
    accuracy = results["enrichment_accuracy"].fillna(0.1)
    assert failures({"enrichment_accuracy": accuracy}).empty
    found = failures({"collision": collision_results["collision"]})
    assert found["where"].tolist() == ["two_livers"] and not found.isin([np.nan]).any(axis=None)
