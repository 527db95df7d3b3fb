"""Declare the tables of the comparison of models in motion: the columns that are read, and a description."""

from palpate.report.table import Table
from palpate.studies.tradeoff.tables import TABLES as PRESSED

TABLES = {
    "advice": PRESSED["advice"],
    "dynamic_accuracy": Table(
        "scene body model setting varied level nodes step_s steps failures rmse_m rmse_of_peak p95_of_peak max_of_peak "
        "ms_per_step step_p95_ms real_time_factor estimate_of_peak estimate_s offline_s reference_level "
        "reference_nodes reference_step_s reference_change duration_s resolved_s",
        "The error of each model over a whole scene in motion, and the time that it takes.",
    ),
    "dynamic_reference": Table(
        "scene step_s time_s change_of_peak bound resolved",
        "What halving the reference's step changes in each frame, and which frames models are compared in.",
    ),
    "motion_bounds": Table(
        "scene body model setting estimate places unresolved failures rank_correlation error_of_peak bound_factor "
        "bound_of_peak sharpness coverage coverage_low estimate_s",
        "Below what the error of nine motions in ten stays where the push is at another place, and how often it did.",
        always=False,
    ),
}
