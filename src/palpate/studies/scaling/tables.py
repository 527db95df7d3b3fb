"""Declare the tables of the study of scaling: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "scaling": Table(
        "component unit size stage seconds memory_mb threads seconds_exponent memory_exponent",
        "The time and the memory of each component over the size of its problem, with fitted exponents.",
    ),
}
