"""Declare the tables of measured bodies: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "measured": Table(
        "body case model setting calibrated quantity measured repeat predicted error experiment marker fitted "
        "young_pa poisson law nodes misfit_m message",
        "What was measured, how far repeats differ, and what each model predicts, with Young's modulus as given and "
        "fitted to one case; error is relative to what was measured. The misfit is how far "
        "the markers are from their places at rest before the release.",
    ),
}
