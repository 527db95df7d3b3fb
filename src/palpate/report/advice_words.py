"""Put advice into words, for the terminal and the report: the statements of advice.md."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

from palpate.benchmark.choosing import NONE
from palpate.benchmark.comparable import STROKED
from palpate.benchmark.ranking import EQUAL, KINDS, TIED_TIMES, UNKNOWN
from palpate.files import templates
from palpate.report.model_looks import label
from palpate.report.words import percent, seconds, two_digits

SAME = "the same"
"""A cell of a table of advice like that on its left."""
STATEMENTS = ("error", "estimate", "bound", "doubts", "rejected", "time", "margin", "prepared", "because")
"""The statements about a model that is advised, in the order of the terminal."""


class _Row(dict):
    """A row of advice, of which an empty cell is NaN."""

    def __missing__(self, name: str) -> float:
        return float("nan")


@cache
def _template() -> Any:
    """Return the macros of advice.md, one a statement."""
    environment = templates(Path(__file__).parent)
    environment.filters |= {"percent": percent, "seconds": seconds, "two_digits": two_digits, "label": label}
    environment.globals |= {"EQUAL": EQUAL, "TIED_TIMES": TIED_TIMES, "UNKNOWN": UNKNOWN, "STROKED": STROKED}
    return environment.get_template("advice.md").module


def say(statement: str, row: pd.Series, **options: Any) -> str:
    """Return a ``statement`` of advice.md, filled with a row of advice, in one line; empty if it has nothing to say."""
    unit = "step" if isinstance(row.get("over"), str) or row.get("times_life", 0.0) > 0.0 else "press"
    values = _Row({"load": "", "unit": unit} | row.to_dict())
    values["bound_on"] = str(values["bound_on"])
    values["mean_error"] = values[KINDS.get(values["error"], KINDS["rms"])]
    text = re.sub(r"[ \n]+", " ", getattr(_template(), statement)(values, **options)).strip()
    return re.sub(r" ([,;.:)])", r"\1", text).replace("( ", "(")


def lines(row: pd.Series) -> str:
    """Return lines for the terminal about a row of advice: the model to take, or none and the nearest, and why."""
    head = f"{row['scene']}, {say('limit', row)}: {row['model']}"
    statements = ("nearest", "because") if row["model"] == NONE else STATEMENTS
    statements_made = {statement: say(statement, row) for statement in statements}
    if row["model"] != NONE:
        head += "" if row["setting"] == "default" else f" {row['setting']}"
        statements_made = {"beware": say("exceeded", row)} | statements_made
    return _plain([head, *(f"  {name:<8}  {text}" for name, text in statements_made.items() if text)])


def _plain(text: list[str]) -> str:
    return "\n".join(text).replace("\u00a0", " ")


def advice_list(advice: pd.DataFrame, kind: str = "rms") -> str:
    """Return advice.csv as lines: each scene, the model to take for each limit with its cost, and what is known.

    kind : of the errors: "rms", "patch" or "force"
    """
    advice = advice[advice["error"] == kind]
    width = max(len(say("limit", row)) for _, row in advice.iterrows())
    peak = {"force": "the peak force", "patch": "the peak displacement at the patch"}.get(kind, "the peak displacement")
    lines = []
    for scene, rows in advice.groupby("scene", sort=False):
        lines.append(f"Advice for {scene} (mean error as a share of {peak}):")
        lines += [f"  {say('limit', row):{width}}  {say('taken', row)}" for _, row in rows.iterrows()]
        least = rows[[KINDS.get(kind, KINDS["rms"]), "max_error"]].min(axis=None)
        scene_known = rows.iloc[0].to_dict() | {"reference_error": rows["reference_error"].max(), "least": least}
        lines.append(f"  {say('known', pd.Series(scene_known))}")
    return _plain([line for line in lines if line.strip()])


def by_limit(advice: pd.DataFrame, names: dict[str, str], cell: Callable[[pd.Series], str]) -> pd.DataFrame:
    """Tabulate advice: a row for each scene, a column for each limit, and in it what ``cell`` writes of that advice.

    names : headings of the rows by scene. A cell that repeats the one on its left is SAME.
    """
    if advice.empty:
        return pd.DataFrame()
    limits = pd.Series([say("limit", row) for _, row in advice.iterrows()], index=advice.index, dtype=object)
    cells = advice.assign(taken=[cell(row) for _, row in advice.iterrows()], limit=limits)
    cells = cells.pivot(index="scene", columns="limit", values="taken").reindex(columns=pd.unique(limits))
    cells = cells.mask(cells.eq(cells.shift(axis=1)) & cells.ne(NONE), SAME)
    return cells.reindex(index=list(names)).rename(index=names).reset_index()
