"""Declare the tables of the hard cases: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "hard_cases": Table(
        "family case source scene model outcome measure value bound frozen zero tenth sharp declared passed message",
        "The outcome of every model in every situation that is known to be difficult, whether it was declared, and the "
        "errors of three wrong answers, which the bound has to fail: frozen, zero, and a tenth more or less.",
    ),
}
