"""Sentences, the figure and the claims about an organ's springs follow from its tables."""

import pandas as pd
import pytest

from palpate.studies.organ_springs.claims import chain

ERRORS = {
    "van_gelder": (0.001, [(0.12, 0.03)], 0.0),
    "uniform": (0.001, [(0.045, 0.034)], 1.0),
    "genetic": (0.001, [(0.027, 0.029)], 20.0),
    "gradient": (0.001, [(0.018, 0.031)], 4.0),
    "zero": (0.4, [(0.6, 0.6)], 0.0),
    "coarse_fem": (0.02, [(0.045, 0.036), (0.086, 0.08)], 0.0),
    "shape_matching": (0.01, [(0.06, 0.05)], 2.0),
}
"""Step [s], errors at fitted and at tested contacts for this and the double step, and the search [s] of each model."""


@pytest.fixture
def tables():
    rows = []
    for number, (model, (step, errors, search)) in enumerate(ERRORS.items()):
        for twice, pair in enumerate(errors, start=1):
            for contact, used in ((3, True), (5, False), (8, False)):
                for seed, factor in enumerate((1.0, 0.5, 2.0) if model == "genetic" else (1.0,)):
                    error, time = factor * pair[1 - used], (8.0 + number) / twice
                    rows.append([model, contact, used, 1e-2 * error, error, time, step * twice, search, seed])
    names = "model contact used_in_fit rmse_m rmse_of_peak ms_a_second step_s offline_s seed"
    springs = pd.DataFrame(rows, columns=names.split()).assign(
        body="liver", volume_force=False, peak_m=1e-2, evaluations=100, reference_error=0.01
    )
    masses = [
        ["own", 1.15, 0.9, 1.1, 1.0, 0.0, 0.0],
        ["uniform", 1.1, 1.0, 1.0, 1.02, 0.03, 0.02],
        ["mean", 1.15, 1.045, 1.045, 1.01, 0.002, 0.001],
    ]
    columns = "masses total_kg least_node_of_uniform most_node_of_uniform frequency_hz change_of_frequency"
    weighed = pd.DataFrame(masses, columns=[*columns.split(), "change_of_motion"])
    return {
        "organ_springs": springs,
        "organ_history": pd.DataFrame({"body": "liver", "model": "genetic", "seed": [1, 2, 3], "generation": 60}),
        "mass_motion": weighed.assign(body="liver", from_ct=True),
    }


def test_claims_are_judged_from_the_tables(tables):
    held, search, masses = chain(tables)
    assert (held.verdict, masses.verdict) == ("confirmed", "refuted")
    assert search.verdict.startswith("not testable: some seeds are better")  # 1.5 to 5.8 %, Van Gelder 3 %
    worse = tables["organ_springs"]
    worse.loc[(worse["model"] == "genetic") & ~worse["used_in_fit"], "rmse_of_peak"] = 0.2
    assert [claim.verdict for claim in chain(tables)][:2] == ["refuted", "refuted"]
