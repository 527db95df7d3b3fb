"""Declare the tables of the hard cases: the columns that are read, and a description."""

from palpate.evaluation.table import Table

TABLES = {
    "hard_cases": Table(
        "family case source scene model outcome measure value bound declared passed message",
        "The outcome of every model in every situation that is known to be difficult, and whether it was declared.",
    ),
}
