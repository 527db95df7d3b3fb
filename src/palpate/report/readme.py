"""Trace the numbers of README.md to the tables of a run, by the queries in docs/readme.yaml."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from palpate.errors import InputError
from palpate.files import read_yaml, require_file

QUERIES = "readme.yaml"
FOUND = "results/readme.csv"
"""The file of docs/ with the queries, and that with what they found in the run of docs/results.md."""
NUMBER = re.compile(r"\d+(?:\.\d+)?")


def look_up(docs: Path, tables: Path) -> pd.DataFrame:
    """Return what a run found for each number that README says: says, take, written, found.

    docs : the folder of readme.yaml; tables : that of a run's tables; what it lacks is left out
    Raises InputError for a query that finds no row, or several values where there should be one.
    """
    rows = []
    for entry in read_yaml(docs / QUERIES)["traced"]:
        file = tables / f"{entry['table']}.csv"
        if file.is_file():
            written = NUMBER.findall(entry["says"])
            found = list(_values(entry, pd.read_csv(file)))
            if len(written) != len(found):
                raise InputError(f"{docs / QUERIES}: {entry['says']!r} has {len(written)} numbers; take as many.")
            rows += [[entry["says"], *each] for each in zip(entry["take"], written, found, strict=True)]
    return pd.DataFrame(rows, columns=["says", "take", "written", "found"])


def _values(entry: dict[str, Any], table: pd.DataFrame) -> Iterator[float]:
    """Yield the values that an entry takes."""
    if "where" in entry:
        table = table.query(entry["where"], engine="python")
    if "once" in entry:
        table = table.drop_duplicates(entry["once"])
    values = table[entry["of"]] if entry["of"] in table else table.eval(entry["of"], engine="python")
    if values.empty and entry["take"] != ["count"]:
        raise InputError(f"{QUERIES}: {entry['says']!r} is found in no row of {entry['table']}.csv; correct its query.")
    for take in entry["take"]:
        if take == "only" and values.nunique() > 1:
            raise InputError(f"{QUERIES}: {entry['says']!r} has {values.nunique()} values; take min, median or max.")
        yield float(len(values) if take == "count" else values.iloc[0] if take == "only" else values.agg(take))


def agrees(written: str, found: float) -> bool:
    """Return whether a number rounds to what is written."""
    digits = len(written.partition(".")[2])
    return abs(found - float(written)) <= 0.5 * 10.0**-digits * (1.0 + 1e-9)


def wrong(rows: pd.DataFrame) -> list[str]:
    """Return a line for each number of ``look_up`` that README says otherwise."""
    return [
        f"README says {row.written} in {row.says!r}, and the run has {row.found:.4g}"
        for row in rows.itertuples()
        if not agrees(str(row.written), row.found)
    ]


def untraced(readme: str, docs: Path) -> list[str]:
    """Return the numbers in the prose of README that no entry of readme.yaml traces, each with the words around it."""
    text = " ".join(re.sub(r"```.*?```|`[^`]*`|\]\([^)]*\)", " ", readme, flags=re.DOTALL).split())
    entries = read_yaml(require_file(docs / QUERIES))
    for kind in ("traced", "given"):
        for entry in entries[kind]:
            text = text.replace(entry["says"], " ")
    return [text[max(found.start() - 30, 0) : found.end() + 10] for found in NUMBER.finditer(text)]
