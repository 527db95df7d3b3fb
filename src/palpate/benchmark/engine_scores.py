"""Tabulate the scores of engines that ran elsewhere beside those of palpate's own models, and which are tied.

Scores of engines are in no other table, so that times of other machines enter no advice for this one.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from palpate.benchmark.ranking import EQUAL, EXACT
from palpate.table_declaration import Table

ANSWERS = Table(
    "answers",
    "The errors, times and failures of an engine's answers at each of its settings, beside palpate's own models.",
    """
    engine version hardware converged: what answered, where, and whether that setting is converged on its mesh
    scene model setting law: what was asked, of whom, and the law of its material
    samples failures: questions that are judged, and those of them without an answer
    rmse_of_peak patch_rms_of_peak patch_max_of_peak max_of_peak: mean errors over the surface and in the dent [peak]
    rmse_of_peak_median rmse_of_peak_p95: median and 95th percentile of questions
    truth_rmse_of_peak truth_patch_rms_of_peak: the truth's own error, below which nothing is told
    mesh_rmse_of_peak mesh_patch_rms_of_peak: what taking the truth through the engine's own mesh costs
    own_law_rmse_of_peak own_law_patch_rms_of_peak: errors against the truth of the engine's own law
    force_error stiffness_error contact_area_error: of touches, mean relative errors of force, its slope and the area
    force_error_median force_error_p95 penetration_of_depth: of its size, and how far points overlap [depth]
    force_rms_of_peak force_peak_error real_time_factor: of motions, errors of force over time [peak], and seconds for a
        second
    online_median_s online_p95_s online_max_s offline_s memory_mb: times of answers, preparation [s], memory [1e6 bytes]
    tied_with: palpate's models that are no less nor more wrong
    """,
    always=False,
)
OWN = "palpate"
"""The engine of rows that palpate's own models have."""


def score_table(scores: pd.DataFrame, truth: Mapping[str, float], beside: pd.DataFrame | None) -> pd.DataFrame:
    """Return the table of ANSWERS: an engine's ``scores``, a row a setting, then palpate's of the same scene.

    truth : means of the truth's own errors, by column; they become columns truth_...
    beside : rows of palpate's own, of accuracy_vs_time.csv or the table of that kind of questions, or None
    """
    engine = scores.assign(**{f"truth_{name}": value for name, value in truth.items()})
    tables = [engine.assign(tied_with=[_ties(row, truth, beside) for _, row in engine.iterrows()])]
    if beside is not None and len(beside):
        tables.append(
            beside.assign(engine=OWN, version=beside.get("commit", ""), hardware="that of the results", tied_with="")
        )
    table = pd.concat([part.dropna(axis=1, how="all") for part in tables], ignore_index=True)
    return table.reindex(columns=ANSWERS.columns)


def _ties(row: pd.Series, truth: Mapping[str, float], beside: pd.DataFrame | None) -> str:
    """Return the models and settings of ``beside`` whose RMSE is within a factor of EQUAL of the row's, as a list.

    Errors below the truth's own count as equal to that.
    """
    if beside is None or not np.isfinite(row["rmse_of_peak"]):
        return ""
    floor = max(EXACT, np.nan_to_num(truth["rmse_of_peak"]))
    error, errors = max(row["rmse_of_peak"], floor), beside["rmse_of_peak"].clip(lower=floor)
    tied = beside[(np.maximum(errors, error) <= EQUAL * np.minimum(errors, error))]
    return "; ".join(f"{name} {setting}" for name, setting in zip(tied["model"], tied["setting"], strict=True))
