"""Read result tables, and say which one is missing or misses a column."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd

from palpate.errors import InputError
from palpate.files import read_table
from palpate.report import declared
from palpate.report.words import spaced

SCALES = {"%": 100.0, "ms]": 1e3, "mm": 1e3}
"""Units of headings, and by what the values of a table are multiplied for them."""


def read(path: str | Path, rows: bool = True) -> pd.DataFrame:
    """Read a CSV table that a study declares.

    Raises InputError if the file is missing or lacks a column, or if it has no rows and must have ``rows``.
    """
    path = Path(path)
    table = read_table(path, declared.table(path.stem).columns)
    if rows and table.empty:
        raise InputError(f"{path} has no rows; delete it and type make.")
    return table


def read_all(folder: str | Path, names: Iterable[str]) -> dict[str, pd.DataFrame]:
    """Read the tables called ``names`` in ``folder``; return them by name.

    Only those of claims may be empty: some settings ask for no model of which a paper claims something.
    """
    return {name: read(Path(folder) / f"{name}.csv", rows=not name.startswith("claim")) for name in names}


def bodies(table: pd.DataFrame) -> list[str]:
    """List the bodies of a table in the order in which they first appear."""
    return list(dict.fromkeys(table["body"]))


def scenes(table: pd.DataFrame) -> list[str]:
    """List the scenes of a table in the order in which they first appear."""
    return list(dict.fromkeys(table["scene"]))


def where(table: pd.DataFrame, **equal) -> pd.DataFrame:
    """Select the rows whose columns equal the values given."""
    for column, value in equal.items():
        table = table[table[column] == value]
    return table


def headed(table: pd.DataFrame, headings: Mapping[str, str]) -> pd.DataFrame:
    """Return columns under the headings of a page, in the units that these name: "error [%]" of a share, "time [ms]".

    headings : by the names of columns; names of bodies, scenes and effects lose their underscores
    """
    columns = {}
    for name, heading in headings.items():
        multiplier = next((factor for unit, factor in SCALES.items() if f"[{unit}" in heading), None)
        columns[heading] = table[name] if multiplier is None else multiplier * table[name]
        if name in ("body", "scene", "effect"):
            columns[heading] = table[name].map(spaced)
    return pd.DataFrame(columns)


def columns(name: str) -> list[str]:
    """Return the columns of the table of that name."""
    return declared.table(name).columns
