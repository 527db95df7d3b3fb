"""Declare the table of the page on which bodies are pressed: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "press": Table(
        "body model contacts samples rmse_of_peak rmse_of_peak_most error_of_peak doubted online_median_s online_p95_s "
        "file_mb",
        "The models that answer in this page: their error on presses whose truth was simulated, the error that they "
        "estimate themselves, how many of these answers they doubt, their time in Python, and the size of their file.",
    ),
}
