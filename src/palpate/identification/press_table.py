"""The table of a CSV file of presses: its encoding, separator and decimals, and its columns by name."""

import re
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from palpate.errors import InputError, suggest
from palpate.given_text import read_cells

NEEDED, NAMES = ("press", "depth_m", "force_n"), ("place", "session", "specimen")
VECTORS = {name: tuple(f"{name}_{axis}" for axis in "xyz") for name in ("direction", "normal")}
AT = ("x_m", "y_m", "z_m")
MEASURED = ("depth_m", "force_n", "time_s", "thickness_m", *AT)
COLUMNS = ("press", *MEASURED, *VECTORS["direction"], *VECTORS["normal"], *NAMES)
"""The columns that are read, in any case and with any signs between letters, "Force (N)"; others are ignored."""
UNITS = {"m": "metres", "n": "newtons", "s": "seconds"}
OTHER_UNITS = {
    "m": r"[cmunμ]m|(centi|milli|micro|nano)met(re|er)s?|in|inch(es)?",
    "n": r"[ckmunμ]n|(centi|milli|micro|kilo)newtons?|[mk]?g|k?gf|(kilo)?grams?|lbf?|m?v|[mk]?pa",
    "s": r"[munμ]s|(milli|micro|nano)seconds?|min|minutes?",
}
"""What names of columns have in place of these, in small letters."""
ANY_UNIT = "|".join((*UNITS, *OTHER_UNITS.values()))


def read_table(
    path: str, columns: Mapping[str, str | Sequence[str]], leave_out: Sequence[str] = ()
) -> tuple[pd.DataFrame, str]:
    """Read a CSV file of presses; return the columns of COLUMNS that it has, and a phrase on how it was read.

    columns : for names of COLUMNS those of the file; of several, the cells are joined by a space
    leave_out : names of presses that are not read
    The index of the table has the lines of the file. Cells are separated by tabs, semicolons or commas, of which the
    header has most; decimals have commas if no number of the file has a point. InputError for what is no table, lacks
    a needed column, or has one in another unit.
    """
    header, rows, lines, remark = read_cells(path)
    sources = {name: [given] if isinstance(given, str) else list(given) for name, given in columns.items()}
    table = pd.DataFrame(_named(path, header, rows, sources), index=pd.Index(lines))
    asked = [name for given in sources.values() for name in given]
    _check_columns(table, [name for name in header if name not in asked], path)
    table = table[~table["press"].isin(list(leave_out))].copy()
    if table.empty:
        raise InputError(f"{path} has no press that leave_out does not name; name fewer.")
    numbers = [name for name in table if name not in ("press", *NAMES)]
    has_commas = any(table[name].str.contains(",").any() for name in numbers)
    if has_commas and not any(table[name].str.contains(".", regex=False).any() for name in numbers):
        table[numbers] = table[numbers].apply(lambda texts: texts.str.replace(",", "."))
        remark += ", decimals have commas"
    for name in numbers:
        table[name] = _numbers(table, name, path)
    if (empty := table.index[table["press"].eq("")]).size:
        raise InputError(f"{path}, row {empty[0]}: press is empty; give the name of the press that the row belongs to.")
    return table, remark


def _plain(name: str) -> str:
    """Return the letters and digits of a name, small."""
    return re.sub(r"[\W_]", "", name.casefold())


PLAIN = {_plain(name): name for name in COLUMNS}


def _named(
    path: str, header: list[str], rows: list[list[str]], columns: Mapping[str, Sequence[str]]
) -> dict[str, list[str]]:
    """Return the cells of each of COLUMNS that a file has, by name: as ``columns`` has it, or in any case.

    InputError for a name of ``columns`` that is not in the file or has another unit, and for two columns of one name.
    """
    indices_of: dict[str, list[int]] = {}
    for number, name in enumerate(header):
        indices_of.setdefault(PLAIN.get(_plain(name), ""), []).append(number)
    indices_of.pop("", None)
    for name, sources in columns.items():
        if name not in COLUMNS:
            raise InputError(f"columns has {name}, which no press has; {suggest(name, list(COLUMNS), 'choose from')}")
        indices_of[name] = []
        for source in sources:
            indices = [number for number, title in enumerate(header) if title == source]
            if not indices:
                raise InputError(
                    f"{path} lacks the column {source}, which columns.{name} names; {suggest(source, header, 'it has')}"
                )
            unit = name.rpartition("_")[2]
            words = map("".join, re.findall(r"[\[(]\s*(\w+)\s*[])]|([^\W_]+)[\W_]*$", source.casefold()))
            if name in MEASURED and any(word != unit and re.fullmatch(ANY_UNIT, word) for word in words):
                raise InputError(
                    f"{path}: columns.{name} names {source}, whose name has another unit; convert it to "
                    f"{UNITS[unit]}, and call it {name}."
                )
            indices_of[name] += indices
    for name, indices in indices_of.items():
        names = [header[number] for number in indices]
        if len(indices) > len(columns.get(name, [name])):
            raise InputError(f"{path} has two columns for {name}, {' and '.join(names)}; leave one of them out.")
    return {name: [" ".join(row[number] for number in indices) for row in rows] for name, indices in indices_of.items()}


def _check_columns(table: pd.DataFrame, others: Sequence[str], path: str) -> None:
    """Raise InputError for missing columns, which names among ``others`` may mean, and incomplete or double vectors."""
    for column in MEASURED:
        stem, _, unit = column.rpartition("_")
        alike = [name for name in others if re.fullmatch(f"{stem}({OTHER_UNITS[unit]})?", _plain(name))]
        if column in NEEDED:
            alike += [name for name in others if name.casefold().startswith(stem)]
        if column not in table and alike:
            raise InputError(
                f"{path} has {alike[0]} and lacks {column}; convert it to {UNITS[unit]} and call it {column}, or name "
                f"it by columns (--column {column}=…) if it is in them."
            )
    if lacking := [name for name in NEEDED if name not in table]:
        raise InputError(
            f"{path} lacks the column {lacking[0]} in its first row; give {', '.join(NEEDED)}, or name them by columns "
            "(--column)."
        )
    for group in (AT, *VECTORS.values()):
        present = [name for name in group if name in table]
        if present and len(present) < 3:
            raise InputError(f"{path} has {present[0]} and not all of {', '.join(group)}; give all three or none.")
        if present and AT[0] not in table:
            raise InputError(f"{path} has {present[0]} and no places; give {', '.join(AT)}, or leave it out.")
    if all(group[0] in table for group in VECTORS.values()):
        raise InputError(f"{path} has directions and normals; leave one of them out.")


def _numbers(table: pd.DataFrame, column: str, path: str) -> pd.Series:
    """Return a column of texts as numbers; InputError for a cell that is empty or no number."""
    fractions = table[column].str.match(r"[-+]?0\d")  # digits behind a decimal comma that has divided a cell
    numbers = pd.to_numeric(table[column], errors="coerce").astype(float).mask(fractions)
    bad_lines = numbers.index[~np.isfinite(numbers)]
    if not len(bad_lines):
        return numbers
    if column not in (*NEEDED, "time_s") and table.loc[bad_lines, column].eq("").all():
        presses_without = table.loc[bad_lines, "press"].nunique()
        raise InputError(
            f"{path}, row {bad_lines[0]}: {column} is empty, and other rows have it; give the places and directions of "
            f"all presses, or of none ({presses_without} of {table['press'].nunique()} lack some)."
        )
    cell = table.at[bad_lines[0], column] or "empty"
    raise InputError(
        f"{path}, row {bad_lines[0]}: {column} is {cell}, which is no number; correct it or leave the row out."
    )
