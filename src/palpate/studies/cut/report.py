"""The part of the report on cuts: who follows, how exactly, and how soon after the blade's move."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from palpate.report import tables
from palpate.report.model_looks import look
from palpate.report.report import Report
from palpate.report.words import percent, seconds, spaced
from palpate.studies.cut.claims import compared
from palpate.studies.cut.figures import ERRORS, FRAMES_MS, WAYS, way_of

TITLE = "After a cut"


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    cut, truth = report.tables["cut"], report.tables["cut_truth"].fillna({"rejected": ""})
    return {
        "scenes": [_of_scene(tables.where(cut, scene=row["scene"]), row) for _, row in truth.iterrows()],
        "beside": _beside(cut),
        "truth_table": _truth(truth),
    }


def _of_scene(cut: pd.DataFrame, truth: pd.Series) -> dict[str, Any]:
    """Return what the template says of one cut."""
    told = cut.dropna(subset="surface_error").sort_values("surface_error", kind="stable")
    soon = told[told["first_median_s"] <= 1e-3 * FRAMES_MS[-1]]
    follows = told[told["step_max_s"] <= 1e-3 * FRAMES_MS[0]]
    known = f"open by {1e3 * truth['opening_m']:.2g}\u00a0mm, known to {percent(truth['opening_error'])}"
    return {
        "scene": truth["scene"],
        "words": spaced(truth["scene"]),
        "known": known if not truth["rejected"] else f"have no truth, as {truth['rejected']}",
        "nearest": _answer(told.iloc[0]) if len(told) else "",
        "soonest": _answer(soon.iloc[0]) if len(soon) else "",
        "within": f"{FRAMES_MS[-1]:g}\u00a0ms",
        "follows": _answer(follows.iloc[0], "step_max_s") if len(follows) else "",
        "frame": f"{FRAMES_MS[0]:g}\u00a0ms",
        "answered": int((cut["failure"].fillna("") == "").sum()),
        "settings": len(cut),
    }


def _answer(row: pd.Series, time: str = "first_median_s") -> str:
    """Return a setting with its errors and a time."""
    surface, opening, force = (percent(row[name]) for name in ERRORS)
    name = f"{look(row['model']).label}, {way_of(row)[0]}, level {row['level']}"
    return f"{name}, in {seconds(row[time])} (surface {surface} off, opening {opening}, force {force})"


def _beside(cut: pd.DataFrame) -> pd.DataFrame:
    """Tabulate finite elements beside springs on the same level that is cut in the same way."""
    rows = []
    for _, row in compared(cut).iterrows():
        shown = {"": spaced(row["scene"]), "level": row["level"], "way": WAYS[row["way"]][0]}
        for title, name in zip(("surface", "opening", "force"), ERRORS, strict=True):
            shown[f"{title}: elements (springs)"] = f"{percent(row[name])} ({percent(row[f'springs_{name}'])})"
        for title, name in (("topology's change", "change_median_s"), ("first answer", "first_median_s")):
            shown[f"{title}: elements (springs)"] = _times(row[name], row[f"springs_{name}"])
        rows.append(shown)
    return pd.DataFrame(rows)


def _times(ours: float, springs: float) -> str:
    return f"{seconds(ours) if ours == ours else 'failed'} ({seconds(springs)})"


def _truth(truth: pd.DataFrame) -> pd.DataFrame:
    """Tabulate how well the truth of each cut is known."""
    return pd.DataFrame(
        {
            "": spaced(row["scene"]),
            "surface [% of peak]": percent(row["surface_error"]),
            "opening": percent(row["opening_error"]),
            "force": percent(row["force_error"]),
            "ratio at the front, at rims": f"{row['front_ratio']:.2g}, {row['rim_ratio']:.2g}",
            "nodes": row["nodes"],
            "time": seconds(row["seconds"]),
        }
        for _, row in truth.iterrows()
    )


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the settings without an answer: what, where, how."""
    cut = report.tables["cut"]
    for row in cut[cut["failure"].fillna("") != ""].itertuples():
        yield f"{look(row.model).label} ({row.setting})", spaced(row.scene), row.failure
