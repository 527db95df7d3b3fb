"""The tables of studies that still declare them apart from their rows, in ``tables.py``."""

from typing import NamedTuple


class Table(NamedTuple):
    """Columns that are read, separated by blanks, and what the table holds; ``always``: whether every run makes it."""

    columns: str
    description: str
    always: bool = True
