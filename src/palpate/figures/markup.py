"""Pieces of the report: tables, pictures and captions as self-contained HTML."""

import base64
from html import escape
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.errors import InputError

_SVG_BYTES = 400_000


def text(value) -> str:
    """A cell: numbers with three significant digits, whole ones with separators, nothing as a dash."""
    if isinstance(value, str):
        return escape(value)
    if value is None or value is pd.NA or not np.isfinite(value):
        return "–"
    if float(value).is_integer() and abs(value) < 1e9:
        return f"{int(value):,}"
    return f"{value:.3g}"


def table(frame: pd.DataFrame, caption: str, faint: list | None = None, best: list[str] = ()) -> str:
    """A data frame as a table.

    faint : positions of the rows that hold the paper's numbers; best : columns whose least value is in bold
    """
    numeric = [all(not isinstance(v, str) or v.lstrip("<\u00a0")[:1].isdigit() for v in frame[c]) for c in frame]
    heads = "".join(
        f'<th scope="col"{" class=number" if n else ""}>{escape(str(c).replace("_", " "))}</th>'
        for c, n in zip(frame.columns, numeric, strict=True)
    )
    least = {c: frame[c].min() for c in best}
    rows = []
    for i, row in enumerate(frame.itertuples(index=False)):
        cells = []
        for column, value, number in zip(frame.columns, row, numeric, strict=True):
            marks = ["number"] * number + ["best"] * bool(column in least and value == least[column])
            cells.append(f'<td class="{" ".join(marks)}">{text(value)}</td>' if marks else f"<td>{text(value)}</td>")
        rows.append(f"<tr{' class=paper' if i in (faint or []) else ''}>{''.join(cells)}</tr>")
    body = "\n".join(rows)
    return (
        f'<div class="scroll"><table><caption>{escape(caption)}</caption>\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody></table></div>"
    )


def image(stem: Path, alt: str) -> str:
    """``stem``.svg if it is small, else ``stem``.png, as an ``img`` with its data inside.

    Raises InputError if the figure is missing.
    """
    vector, raster = stem.with_name(f"{stem.name}.svg"), stem.with_name(f"{stem.name}.png")
    for path in (vector, raster):
        if not path.is_file():
            raise InputError(f"{path} is missing: make it with the workflow (make) first")
    if vector.stat().st_size <= _SVG_BYTES:
        kind, data = "svg+xml", vector.read_bytes()
    else:
        kind, data = "png", raster.read_bytes()
    return f'<img alt="{escape(alt)}" src="data:image/{kind};base64,{base64.b64encode(data).decode()}">'


def figure(folder: Path, name: str, caption: str) -> str:
    """A picture with its caption (HTML) and a link to the file."""
    picture = image(folder / name, name.replace("_", " "))
    return (
        f'<figure id="{name}">\n<a href="figures/{name}.svg">{picture}</a>\n'
        f"<figcaption>{caption}</figcaption>\n</figure>"
    )


def animation(folder: Path, name: str, caption: str) -> str:
    """``name``.gif, its data inside, with its caption (HTML) and a link to the file.

    Raises InputError if it is missing.
    """
    path = folder / f"{name}.gif"
    if not path.is_file():
        raise InputError(f"{path} is missing: make it with the workflow (make) first")
    data = base64.b64encode(path.read_bytes()).decode()
    return (
        f'<figure id="animation_{name}">\n<a href="figures/{name}.gif">'
        f'<img alt="{escape(name.replace("_", " "))}, animated" src="data:image/gif;base64,{data}"></a>\n'
        f"<figcaption>{caption}</figcaption>\n</figure>"
    )


def folded(frame: pd.DataFrame, name: str) -> str:
    """A long table, closed at first, and a link to its CSV."""
    inner = table(frame, f"{name}.csv")
    return (
        f"<details><summary>all {len(frame):,} rows of {name}.csv</summary>\n"
        f'<p><a href="tables/{name}.csv">tables/{name}.csv</a></p>\n{inner}\n</details>'
    )


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
        raise InputError(f"{path}: there is no number called {unknown}: see palpate/figures/summary.py") from None
    settings = {"halt_level": 2, "report_level": 2, "file_insertion_enabled": False, "raw_enabled": False}
    return publish_parts(source, writer="html5", settings_overrides=settings)["body"].strip()
