"""Make tables, pictures, and views that turn, into self-contained HTML."""

import re
import zlib
from collections.abc import Sequence
from html import escape
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.files import require_file
from palpate.report.page_assets import base64_of
from palpate.report.words import spaced
from palpate.table_declaration import Table

_LONG = 60  # rows of a folded table from which on the page holds it deflated
_WIDTHS = {18: "mid", 40: "long", 120: "text"}  # the class of a cell with more characters, which may break into lines
_QUANTITY = re.compile(r"[-+<~\s]*[\d.,]+(e[-+]?\d+)?(\s?(%|µs|ms|s|min|h|kB|MB))?(\s\[.*\])?(\s\(.*\))?")

MARKS = {word: "good" for word in ("confirmed", "stable")}
MARKS |= {word: "bad" for word in ("refuted", "wrong", "nan")}
MARKS |= {word: "open" for word in ("confirmed outside its premise", "refuted outside its premise")}
MARKS |= {word: "open" for word in ("true as a bound", "refused", "not converged")}
"""How a verdict or an outcome is marked: the sign and colour of its cell."""


def text(value) -> str:
    """Format a cell: numbers with three significant digits, whole ones with separators, nothing as a dash."""
    if isinstance(value, str):
        return value
    if value is None or value is pd.NA or not np.isfinite(value):
        return "–"
    if float(value).is_integer() and abs(value) < 1e9:
        return f"{int(value):,}"
    return f"{value:.3g}"


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
    least_values = {c: frame[c].min() for c in best}
    rows = []
    for i, row in enumerate(frame.itertuples(index=False)):
        cells = []
        for column, value, number in zip(frame.columns, row, numeric, strict=True):
            marks = ["number"] * number + ["best"] * bool(column in least_values and value == least_values[column])
            if isinstance(value, str):
                mark = "open" if value.startswith("not testable: ") else MARKS.get(value)
                marks += [mark] if mark else []
                if not number:
                    marks += [width for least_length, width in _WIDTHS.items() if len(value) > least_length][-1:]
            cell = escape(text(value))
            cells.append(f'<td class="{" ".join(marks)}">{cell}</td>' if marks else f"<td>{cell}</td>")
        rows.append(f"<tr{' class=paper' if i in faint else ''}>{''.join(cells)}</tr>")
    body = "\n".join(rows)
    return (
        f'<div class="scroll"><table><caption>{escape(caption)}</caption>\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody></table></div>"
    )


def fold(summary: str, inner: str) -> str:
    """Return HTML that is shown when somebody clicks on ``summary``."""
    return f"<details><summary>{escape(summary)}</summary>\n{inner}\n</details>"


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
    return f'<div class="scroll" data-caption="{escape(caption)}" data-packed="{base64_of(data)}"></div>'


def _numeric(frame: pd.DataFrame) -> list[bool]:
    """Return which columns hold numbers, or quantities in words: "5 ms", "6 % [5 %, 7 %]"."""
    return [all(not isinstance(v, str) or _QUANTITY.fullmatch(v) for v in frame[c]) for c in frame]


def _name(column) -> str:
    """Return a column's heading."""
    return spaced(str(column))


_SVG_BYTES = 100_000
_QUALITY = 88  # of pictures with shades: a fifth of a PNG's bytes, without a visible difference
_SHADED = 3.0  # a PNG this much larger has shades: its file without loss takes ten times as long, and is larger, too
_PNG_DPI, _CSS_DPI = 160, 96


def image(stem: Path, alt: str) -> str:
    """Return ``stem``.svg if it is small, else ``stem``.png as WebP, as an ``img`` of its natural size.

    A drawing of few colours is sharp and smaller without loss, one with shades smaller with it.
    Raises InputError if the figure is missing.
    """
    data, width, height = _data(stem)
    return f'<img alt="{escape(alt)}" width="{width}" height="{height}" src="{data}">'


def _data(stem: Path) -> tuple[str, int, int]:
    """Return a figure as the address of an ``img``, and its width and height [CSS pixel]."""
    vector, raster = (require_file(stem.with_name(f"{stem.name}.{suffix}")) for suffix in ("svg", "png"))
    if vector.stat().st_size <= _SVG_BYTES:
        data = vector.read_bytes()
        return f"data:image/svg+xml;base64,{base64_of(data)}", *_svg_size(data)
    from PIL import Image

    picture = Image.open(raster).convert("RGB")
    encodings = BytesIO(), BytesIO()
    picture.save(encodings[0], "WEBP", quality=_QUALITY, method=4)
    if raster.stat().st_size < _SHADED * encodings[0].tell():
        picture.save(encodings[1], "WEBP", lossless=True, method=4)
    shortest = min(filter(None, (file.getvalue() for file in encodings)), key=len)
    width, height = (round(_CSS_DPI / _PNG_DPI * size) for size in picture.size)
    return f"data:image/webp;base64,{base64_of(shortest)}", width, height


def _svg_size(data: bytes) -> tuple[int, int]:
    """Read the size of a drawing [CSS pixel] from its first lines, which give it in points."""
    head = data[:2000].partition(b"<svg")[2].partition(b">")[0]
    points = dict(re.findall(rb'\b(width|height)="([\d.]+)pt"', head))
    width, height = (float(points[name]) * _CSS_DPI / 72 for name in (b"width", b"height"))
    return round(width), round(height)


def figure(folder: Path, name: str, caption: str, small: str | None = None) -> str:
    """Return a picture in a box of its own with its caption (HTML); on narrow screens the picture ``small``."""
    shown = image(folder / name, spaced(name))
    if small:
        address, width, height = _data(folder / small)
        source = f'<source media="(max-width: 44rem)" srcset="{address}" width="{width}" height="{height}">'
        shown = f"<picture>{source}{shown}</picture>"
    return (
        f'<figure id="figure_{name}">\n<div class="pane">{shown}</div>\n<figcaption>{caption}</figcaption>\n</figure>'
    )


def turnable(folder: Path, name: str, title: str, caption: str) -> str:
    """Return the surface in ``name``.json, to be turned, under its title, with its caption (HTML).

    Raises InputError if it is missing.
    """
    data = require_file(folder / f"{name}.json").read_text(encoding="ascii").replace("<", "\\u003c")
    return (
        f'<figure class="turn" id="turn_{name}" data-title="{escape(title)}">\n'
        f'<script type="application/json">{data}</script>\n'
        f"<noscript><p>Here is a view that turns; it needs scripts to be allowed.</p></noscript>\n"
        f"<figcaption>{caption}</figcaption>\n</figure>"
    )
