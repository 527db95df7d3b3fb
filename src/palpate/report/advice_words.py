"""Put advice into words, for the terminal and the report: the statements of advice.md."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd

from palpate.benchmark.choosing import NONE
from palpate.benchmark.comparable import STROKED
from palpate.benchmark.ranking import EQUAL, KINDS, TIED_TIMES, UNKNOWN
from palpate.report.model_looks import label
from palpate.report.words import percent, seconds, two_digits

SAME = "the same"
"""A cell of a table of advice like that on its left."""
SAID = ("error", "estimate", "bound", "doubts", "rejected", "time", "margin", "prepared", "because")
"""The statements about a model that is advised, in the order of the terminal."""


class _Row(dict):
    """A row of advice, of which an empty cell is NaN."""

    def __missing__(self, name: str) -> float:
        return float("nan")


def _error(row: dict[str, Any]) -> float:
    """Return the error of the kind that a row is about."""
    return float(row.get(KINDS.get(row["error"], KINDS["rms"]), float("nan")))


@cache
def _words() -> Any:
    """Return the macros of advice.md."""
    folder = jinja2.FileSystemLoader(Path(__file__).parent)
    environment = jinja2.Environment(trim_blocks=True, lstrip_blocks=True, loader=folder)
    environment.filters |= {"percent": percent, "seconds": seconds, "two_digits": two_digits, "label": label}
    environment.filters["error"] = _error
    environment.globals |= {"EQUAL": EQUAL, "TIED_TIMES": TIED_TIMES, "UNKNOWN": UNKNOWN, "STROKED": STROKED}
    return environment.get_template("advice.md").module


def say(what: str, row: pd.Series, **more: Any) -> str:
    """Return one statement of advice.md about a row of advice, in one line; empty where there is nothing to say."""
    known = _Row({"load": "", "unit": "step" if moves(row) else "press"} | row.to_dict())
    known["bound_on"] = str(known["bound_on"])
    said = re.sub(r"[ \n]+", " ", str(getattr(_words(), what)(known, **more))).strip()
    return re.sub(r" ([,;.:)])", r"\1", said).replace("( ", "(")


def moves(row: pd.Series) -> bool:
    """Return whether a row of advice.csv is about a scene that moves."""
    return isinstance(row.get("over"), str) or row.get("times_life", 0.0) > 0.0


def lines(advice: pd.Series, rows: pd.DataFrame | None = None) -> str:
    """Return lines for the terminal about one row of advice: what to take, or none, and the nearest.

    rows : of a scene that moves its rows of dynamic_accuracy.csv
    """
    head = f"{advice['scene']}, {say('limit', advice)}: "
    if advice["model"] == NONE:
        told = {"nearest": say("nearest", advice), "because": say("because", advice)}
        return _indented(head + NONE, told)
    if rows is not None:
        row = rows[(rows["model"] == advice["model"]) & (rows["setting"] == advice["setting"])].iloc[0]
        advice = pd.Series(row.to_dict() | advice.to_dict())
    told = {"beware": say("exceeded", advice)} | {what: say(what, advice) for what in SAID}
    setting = "" if advice["setting"] == "default" else f" {advice['setting']}"
    return _indented(f"{head}{advice['model']}{setting}", told)


def _indented(head: str, said: dict[str, str]) -> str:
    rows = [head, *(f"  {key:<8}  {text}" for key, text in said.items() if text)]
    return "\n".join(rows).replace("\u00a0", " ")


def advice_list(advice: pd.DataFrame, kind: str = "rms") -> str:
    """Return advice.csv as lines: each scene, and under it what to take for each limit, and what it costs.

    kind : of the errors
    """
    advice = advice[advice["error"] == kind]
    width = max(len(say("limit", row)) for _, row in advice.iterrows())
    of = "the peak force" if kind == "force" else "the peak displacement"
    found = []
    for scene, rows in advice.groupby("scene", sort=False):
        found.append(f"Advice for {scene} (mean error as a share of {of}{' at the patch' * (kind == 'patch')}):")
        found += [f"  {say('limit', row):{width}}  {say('taken', row)}" for _, row in rows.iterrows()]
        least = rows[[KINDS.get(kind, KINDS["rms"]), "max_error"]].min(axis=None)
        known = rows.iloc[0].to_dict() | {"reference_error": rows["reference_error"].max(), "least": least}
        if said := say("known", pd.Series(known)):
            found.append(f"  {said}")
    return "\n".join(found).replace("\u00a0", " ")


def by_limit(advice: pd.DataFrame, names: dict[str, str], cell: Callable[[pd.Series], str]) -> pd.DataFrame:
    """Tabulate advice: a row for each scene of ``names``, a column for each limit, cells as ``cell`` puts them.

    A cell that repeats the one on its left is SAME.
    """
    if advice.empty:
        return pd.DataFrame()
    limits = pd.Series([say("limit", row) for _, row in advice.iterrows()], index=advice.index, dtype=object)
    wide = advice.assign(taken=[cell(row) for _, row in advice.iterrows()], limit=limits)
    wide = wide.pivot(index="scene", columns="limit", values="taken").reindex(columns=pd.unique(limits))
    wide = wide.mask(wide.eq(wide.shift(axis=1)) & wide.ne(NONE), SAME)
    return wide.reindex(index=list(names)).rename(index=names).reset_index()
