"""Declare the tables of the comparison of models: the columns that are read, and a description."""

from palpate.evaluation.table import Table

TABLES = {
    "accuracy_vs_time": Table(
        "scene body regime model setting protocol split samples failures rmse_m rmse_of_peak p95_of_peak "
        "max_of_peak online_median_s online_p95_s offline_s memory_mb break_even_queries threads commit "
        "failure",
        "The error, the time, the preparation and the memory of every model at each of its settings.",
    ),
    "advice": Table(
        "scene budget_ms max_error model setting rmse_of_peak error_low error_high p95_of_peak online_p95_s "
        "margin confidence rival rival_setting factor reference_error faster faster_setting faster_error faster_high "
        "faster_factor why",
        "The model and setting to take for each limit of time or error, the next best one, and the reason.",
    ),
}
