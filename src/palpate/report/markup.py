"""Make tables and captions into self-contained HTML."""

import base64
import re
import zlib
from collections.abc import Sequence
from html import escape

import numpy as np
import pandas as pd

from palpate.table import Table

_LONG = 60  # rows of a folded table from which on the page holds it deflated
_WIDTHS = {18: "mid", 40: "long", 120: "text"}  # the class of a cell with more characters, which may break into lines
_QUANTITY = re.compile(r"[-+<~\s]*[\d.,]+(e[-+]?\d+)?(\s?(%|µs|ms|s|min|h|kB|MB))?(\s\[.*\])?(\s\(.*\))?")

MARKS = {word: "good" for word in ("confirmed", "stable")}
MARKS |= {word: "bad" for word in ("refuted", "wrong", "nan")}
MARKS |= {word: "open" for word in ("true as a bound", "refuted outside its premise", "refused", "not converged")}
"""How a verdict or an outcome is marked: the sign and colour of its cell."""
_REASONED = "not testable: "
"""How a verdict begins that gives a reason; it is open, too."""


def text(value) -> str:
    """Format a cell: numbers with three significant digits, whole ones with separators, nothing as a dash."""
    if isinstance(value, str):
        return value
    if value is None or value is pd.NA or not np.isfinite(value):
        return "–"
    if float(value).is_integer() and abs(value) < 1e9:
        return f"{int(value):,}"
    return f"{value:.3g}"


def escaped(words: str) -> str:
    """Return text as HTML."""
    return escape(words)


def table(frame: pd.DataFrame, caption: str, faint: Sequence[int] = (), best: Sequence[str] = ()) -> str:
    """Return a data frame as a table, which the page's script makes sortable.

    faint : positions of the rows that hold a paper's numbers; best : columns whose least value is in bold
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
            marks += [mark] if isinstance(value, str) and (mark := _mark(value)) else []
            if isinstance(value, str) and not number:
                marks += [width for least_length, width in _WIDTHS.items() if len(value) > least_length][-1:]
            cell = escape(text(value))
            cells.append(f'<td class="{" ".join(marks)}">{cell}</td>' if marks else f"<td>{cell}</td>")
        rows.append(f"<tr{' class=paper' if i in faint else ''}>{''.join(cells)}</tr>")
    body = "\n".join(rows)
    return (
        f'<div class="scroll"><table><caption>{escape(caption)}</caption>\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody></table></div>"
    )


def _mark(value: str) -> str:
    """Return the class of a cell that is a verdict or an outcome; empty for any other."""
    return "open" if value.startswith(_REASONED) else MARKS.get(value, "")


def fold(summary: str, inner: str, opened: bool = False) -> str:
    """Return HTML that is shown when somebody clicks on ``summary``."""
    return f"<details{' open' if opened else ''}><summary>{escape(summary)}</summary>\n{inner}\n</details>"


def folded(frame: pd.DataFrame, about: Table) -> str:
    """Return a whole table, closed at first, under what it holds; if it is long, the script makes it when opened."""
    name, caption = escape(about.name), f"{about.name}.csv"
    inner = table(frame, caption) if len(frame) < _LONG else _packed(frame, caption)
    meant = "; ".join(f"<i>{columns}</i>: {escape(words)}" for columns, words in about.meanings.items() if words)
    return (
        f'<details class="data"><summary><b>Table {name}</b>, {len(frame):,} rows. {escape(about.description)}'
        f"</summary>\n<p>All digits are in <code>results/tables/{name}.csv</code>. {meant}</p>\n{inner}\n</details>"
    )


def _packed(frame: pd.DataFrame, caption: str) -> str:
    """Return a long table as deflated lines: names, classes of the columns, rows."""
    lines = [map(_name, frame.columns), ("number" if n else "" for n in _numeric(frame))]
    lines += [map(text, row) for row in frame.itertuples(index=False)]
    data = zlib.compress("\n".join("\t".join(line) for line in lines).encode(), 9)
    packed = base64.b64encode(data).decode("ascii")
    return f'<div class="scroll" data-caption="{escape(caption)}" data-packed="{packed}"></div>'


def _numeric(frame: pd.DataFrame) -> list[bool]:
    """Return which columns hold numbers, or quantities in words: "5 ms", "6 % [5 %, 7 %]"."""
    return [all(not isinstance(v, str) or _QUANTITY.fullmatch(v) for v in frame[c]) for c in frame]


def _name(column) -> str:
    """Return a column's heading."""
    return str(column).replace("_", " ")
