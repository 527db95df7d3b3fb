"""Pieces of the report: tables and captions as self-contained HTML."""

import base64
import zlib
from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.errors import InputError

_LONG = 300  # rows of a folded table from which on the page holds it deflated

MARKS = {word: "good" for word in ("confirmed", "stable")}
MARKS |= {word: "bad" for word in ("refuted", "wrong", "nan")}
MARKS |= {word: "open" for word in ("true as a bound", "cannot be compared", "refused", "not_converged")}
"""How a verdict or an outcome is marked: the sign and colour of its cell."""


def text(value) -> str:
    """A cell: numbers with three significant digits, whole ones with separators, nothing as a dash."""
    if isinstance(value, str):
        return value
    if value is None or value is pd.NA or not np.isfinite(value):
        return "–"
    if float(value).is_integer() and abs(value) < 1e9:
        return f"{int(value):,}"
    return f"{value:.3g}"


def table(frame: pd.DataFrame, caption: str, faint: list | None = None, best: Sequence[str] = ()) -> str:
    """A data frame as a table, which the page's script makes sortable.

    faint : positions of the rows that hold the paper's numbers; best : columns whose least value is in bold
    A cell that is no more than a verdict or an outcome gets its colour and sign.
    """
    numeric = _numeric(frame)
    heads = "".join(
        f'<th scope="col"{" class=number" if n else ""}>{escape(_name(c))}</th>'
        for c, n in zip(frame.columns, numeric, strict=True)
    )
    least = {c: frame[c].min() for c in best}
    rows = []
    for i, row in enumerate(frame.itertuples(index=False)):
        cells = []
        for column, value, number in zip(frame.columns, row, numeric, strict=True):
            marks = ["number"] * number + ["best"] * bool(column in least and value == least[column])
            marks += [MARKS[value]] if isinstance(value, str) and value in MARKS else []
            cell = escape(text(value))
            cells.append(f'<td class="{" ".join(marks)}">{cell}</td>' if marks else f"<td>{cell}</td>")
        rows.append(f"<tr{' class=paper' if i in (faint or []) else ''}>{''.join(cells)}</tr>")
    body = "\n".join(rows)
    return (
        f'<div class="scroll"><table><caption>{escape(caption)}</caption>\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody></table></div>"
    )


def folded(frame: pd.DataFrame, name: str) -> str:
    """A whole table, closed at first, and a link to its CSV; if it is long, the script makes it when it is opened."""
    inner = table(frame, f"{name}.csv") if len(frame) <= _LONG else _packed(frame, f"{name}.csv")
    return (
        f"<details><summary>all {len(frame):,} rows of {name}.csv</summary>\n"
        f'<p><a href="tables/{name}.csv">tables/{name}.csv</a></p>\n{inner}\n</details>'
    )


def _packed(frame: pd.DataFrame, caption: str) -> str:
    """A long table as deflated lines: names, classes of the columns, rows."""
    lines = [map(_name, frame.columns), ("number" if n else "" for n in _numeric(frame))]
    lines += [map(text, row) for row in frame.itertuples(index=False)]
    data = zlib.compress("\n".join("\t".join(line) for line in lines).encode(), 9)
    packed = base64.b64encode(data).decode("ascii")
    return f'<div class="scroll" data-caption="{escape(caption)}" data-packed="{packed}"></div>'


def _numeric(frame: pd.DataFrame) -> list[bool]:
    """Which columns hold numbers, or texts that begin with one."""
    return [all(not isinstance(v, str) or v.lstrip("<\u00a0")[:1].isdigit() for v in frame[c]) for c in frame]


def _name(column) -> str:
    """A column's heading."""
    return str(column).replace("_", " ")


def caption(folder: Path, name: str, values: dict[str, str]) -> str:
    """The caption ``name``.rst with its placeholders filled, as HTML.

    Raises InputError if the file is missing or asks for a number there is not.
    """
    from docutils.core import publish_parts

    path = Path(folder) / f"{name}.rst"
    if not path.is_file():
        raise InputError(f"{path} is missing: put the caption back")
    try:
        source = path.read_text(encoding="utf-8").format(**values)
    except KeyError as unknown:
        raise InputError(f"{path}: there is no number called {unknown}: see palpate/report/numbers.py") from None
    settings = {"halt_level": 2, "report_level": 2, "file_insertion_enabled": False, "raw_enabled": False}
    return publish_parts(source, writer="html5", settings_overrides=settings)["body"].strip()
