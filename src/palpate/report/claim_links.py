"""Find which rows of which tables a claim rests on: those whose change changes what is judged.

Nobody states the links, so that they cannot be wrong: the numbers of all rows that share a value of a column, such as
one body's, are multiplied, and the claims that then read differently rest on them. What is found is checked: with the
numbers of all other rows multiplied, the claim is word for word the same. Rows of claims that read no number are left
out instead; one that cannot be tested rests on nothing.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.errors import InputError
from palpate.report import snapshot
from palpate.report.claims import NOT_TESTABLE, Claim, judge_of
from palpate.report.declared import CLAIM_LINKS

Tables = Mapping[str, pd.DataFrame]
Judge = Callable[[dict[str, pd.DataFrame]], Iterable[Claim]]
Chosen = Mapping[str, np.ndarray]
"""Some rows of some tables, (n,) bool each."""
MULTIPLIED, LEFT_OUT = (3.7, 0.2), (0.0,)
"""Ways to change rows: by factors up and down, as a claim may bound numbers from one side only; 0 leaves them out."""
UNEVEN = (0.7, 1.3)
"""Powers of a factor between which numbers differ, so that their ratios change, too."""
AS_WRITTEN = "as written"
"""The verdict on a number of README that this run has, too."""
MOST_VALUES = 8
"""Most different values of a column by which rows are told apart."""


class Link(NamedTuple):
    """The rows of a table that a claim rests on.

    where : a query of the table, empty for all rows; rows : how many it selects
    """

    table: str
    where: str
    rows: int


NOTHING = Link("", "", 0)
"""What a claim rests on that follows from a formula or cannot be tested."""


def links(judge: Judge, tables: Tables) -> list[tuple[Claim, list[Link]]]:
    """Return the claims that ``judge`` yields from ``tables``, each with the rows that it rests on."""
    claims = list(judge(dict(tables)))
    trial = _Trial(judge, tables, claims)
    found: dict[Claim, list[Link]] = {claim: [] for claim in claims}
    for ways in (MULTIPLIED, LEFT_OUT):
        left = [claim for claim in claims if not found[claim]]
        if ways == LEFT_OUT:
            left = [claim for claim in left if not claim.verdict.startswith(NOT_TESTABLE)]
        for claim, needed in trial.needed(left, ways).items():
            found[claim] = list(trial.narrowest(claim, needed, ways))
    return [(claim, found[claim]) for claim in claims]


def gather_links(
    places: Mapping[str, Sequence[str]], tables: Tables, entries: Iterable[dict[str, Any]]
) -> pd.DataFrame:
    """Return the rows of CLAIM_LINKS.

    places : as ``claims.gather`` has them; entries : those of README's numbers, of which the ones are left out whose
        rows this run does not have
    """
    rows: list[list[Any]] = []
    for place, wanted in places.items():
        for claim, found in links(judge_of(place), {name: tables[name] for name in wanted}):
            about = [f"paper {claim.paper}", claim.claim, claim.premise]
            rows += [[*about, *link, claim.ours, claim.verdict] for link in found or [NOTHING]]
    rows.sort(key=lambda row: row[0])
    for entry in entries:
        rows += _readme_rows(entry, tables)
    return CLAIM_LINKS.frame(rows)


def _readme_rows(entry: dict[str, Any], tables: Tables) -> list[list[Any]]:
    """Return the rows of one entry; none where a run of other settings has none or several values for it."""
    if entry["table"] not in tables:
        return []
    try:
        values = snapshot.taken(entry, tables[entry["table"]])
        found = list(snapshot.numbers(entry, values)) if len(values) else []
    except InputError:
        return []
    link = [entry["table"], entry.get("where", ""), len(values)]
    verdicts = [AS_WRITTEN if snapshot.agrees(text, value) else f"differs: {text}" for _, text, value in found]
    return [
        ["README", entry["says"], take, *link, f"{value:.4g}", verdict]
        for (take, _, value), verdict in zip(found, verdicts, strict=True)
    ]


Needed = dict[str, dict[str, list]]
"""By table and column, the values whose rows change a claim; a table with no column in it matters as a whole."""


class _Trial:
    """What is judged if some rows change; ``keys`` are the columns of each table by which rows are told apart."""

    def __init__(self, judge: Judge, tables: Tables, claims: Sequence[Claim]):
        self._judge, self._tables, self._claims = judge, tables, claims
        self._keys = {name: _keys(table) for name, table in tables.items()}

    def needed(self, claims: Collection[Claim], ways: Iterable[float]) -> dict[Claim, Needed]:
        """Return what changes each of some claims."""
        found: dict[Claim, Needed] = {claim: {} for claim in claims}
        for name, table in self._tables.items() if claims else ():
            concerned = self._changed(name, np.ones(len(table), dtype=bool), set(claims), ways)
            for claim in concerned:
                found[claim][name] = {}
            for column in self._keys[name] if concerned else ():
                for value in table[column].dropna().unique().tolist():
                    for claim in self._changed(name, (table[column] == value).to_numpy(), concerned, ways):
                        found[claim][name].setdefault(column, []).append(value)
        return found

    def _changed(self, name: str, rows: np.ndarray, among: set[Claim], ways: Iterable[float]) -> set[Claim]:
        """Return which claims read differently once some ``rows`` (n,) of a table change."""
        same = among
        for way in ways:
            same = same & self._judged({name: rows}, way) if same else same
        return among - same

    def _judged(self, chosen: Chosen, way: float) -> set[Claim]:
        """Return the claims that stay the same where the ``chosen`` rows are changed.

        Where one cannot be judged any more, those after it are not known to change.
        """
        changed, found = dict(self._tables), []
        for name, rows in chosen.items():
            table = self._tables[name]
            changed[name] = _multiplied(table, rows, way, self._keys[name]) if way else table[~rows]
        try:
            with np.errstate(all="ignore"):
                for claim in self._judge(changed):
                    found.append(claim)
        except (ArithmeticError, LookupError, ValueError):  # numbers that make no sense
            found += self._claims[len(found) + 1 :]
        return set(found)

    def narrowest(self, claim: Claim, needed: Needed, ways: Iterable[float]) -> Iterator[Link]:
        """Yield the narrowest selections that hold the claim; columns are given up from the last on until they do."""
        columns = {
            name: {key: values for key, values in of.items() if len(values) < self._tables[name][key].nunique()}
            for name, of in needed.items()
        }
        while True:
            chosen = {name: selected(self._tables[name], _query(of)) for name, of in columns.items()}
            rest = {name: ~rows for name, rows in chosen.items()}
            if not any(columns.values()) or all(claim in self._judged(rest, way) for way in ways):
                break
            columns[max(columns, key=lambda name: len(columns[name]))].popitem()
        for name, rows in chosen.items():
            for key in list(columns[name])[::-1]:
                fewer = {other: values for other, values in columns[name].items() if other != key}
                if (selected(self._tables[name], _query(fewer)) == rows).all():
                    columns[name] = fewer
            yield Link(name, _query(columns[name]), int(rows.sum()))


def _multiplied(table: pd.DataFrame, rows: np.ndarray, factor: float, keys: Collection[str]) -> pd.DataFrame:
    """Return a table with the numbers of some rows multiplied, each a little differently, and its truths reversed."""
    random, columns = np.random.default_rng(0), {}
    for name, column in table.items():
        if pd.api.types.is_bool_dtype(column) and name not in keys:
            columns[name] = column ^ rows
        elif pd.api.types.is_numeric_dtype(column) and name not in keys:
            factors = np.where(rows, factor ** random.uniform(*UNEVEN, len(table)), 1.0)
            whole = pd.api.types.is_integer_dtype(column)
            columns[name] = (factors * column).round().astype(column.dtype) if whole else factors * column
    return table.assign(**columns)


def _keys(table: pd.DataFrame) -> list[str]:
    """Return the columns by whose values rows are told apart: of few values, and not what an earlier one implies.

    Real numbers are settings, and not results, if they are short and each is that of several rows.
    """
    found: list[str] = []
    for name, column in table.items():
        count = column.nunique()
        setting = not pd.api.types.is_float_dtype(column) or (
            3 * count <= len(table) and all(float(f"{value:.3g}") == value for value in column.dropna().unique())
        )
        implied = (table.groupby(key)[name].nunique().max() == 1 for key in found)
        if setting and 1 < count <= MOST_VALUES and not any(implied):
            found.append(name)
    return found


def _query(columns: Mapping[str, list]) -> str:
    """Write a selection as ``DataFrame.query`` reads it."""
    return " and ".join(f"{name} in {values!r}" for name, values in columns.items())


def selected(table: pd.DataFrame, where: str) -> np.ndarray:
    """Return which rows of a table a query selects, (n,) bool."""
    numbered = table.reset_index(drop=True)
    chosen = numbered.query(where, engine="python").index if where else numbered.index
    return np.isin(np.arange(len(table)), chosen)
