"""Compute what the report says of models in motion beside its tables: what to take, and how wrong standards are."""

from typing import Any

import pandas as pd

from palpate.benchmark.advice import QUADRATIC, MeshError, mesh_error, parted
from palpate.benchmark.choosing import NONE
from palpate.report import tables
from palpate.report.advice_words import by_limit, say
from palpate.report.model_looks import label
from palpate.report.report import Report
from palpate.report.words import percent, spaced


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its tables."""
    table, advice = report.tables["dynamic_accuracy"], report.tables.get("advice")
    first = table.drop_duplicates("scene")
    names = {str(row["scene"]): _judged(row) for _, row in first.iterrows()}
    first = first.assign(parted=[parted(row) for _, row in first.iterrows()])
    truths, standards = first[first["reference"] == QUADRATIC], first[first["reference"] != QUADRATIC]
    known, unknown = _meshes(standards[standards["reference_error"].isna()], report.tables.get("accuracy_vs_time"))
    values = {
        "truths": truths,
        "standards": standards,
        "best": _most_accurate(table[~table["scene"].isin(first.loc[first["parted"] != "", "scene"])]),
        "meshes": known,
        "unknown_meshes": unknown,
        "taken": pd.DataFrame() if advice is None else _taken(advice[advice["scene"].isin(names)], names),
    }
    if "motion_bounds" in report.tables:
        bounds = report.tables["motion_bounds"]
        models = [label(row.model, row.setting) for row in bounds.itertuples()]
        estimates = bounds["estimate"].map({"constant": "nothing", "own": "its own motion"})
        values["motion_bounds"] = bounds.assign(model=models, estimate=estimates)
    return values


def _judged(row: pd.Series) -> str:
    """Name a scene, and what of it is judged where that is a part; row : of dynamic_accuracy.csv."""
    part = row["resolved_s"] < row["duration_s"] * (1 - 1e-9)
    return spaced(row["scene"]) + (f" (first {row['resolved_s']:.2g} of {row['duration_s']:.2g} s)" if part else "")


def _taken(advice: pd.DataFrame, names: dict[str, str]) -> pd.DataFrame:
    """Tabulate what to take in each scene, beside the own error of the standard that errors are from."""
    own = advice.groupby("scene")["reference_error"].max().reindex(list(names))
    wide = by_limit(advice, names, lambda row: NONE if row["model"] == NONE else say("taken", row))
    if len(wide):
        wide.insert(1, "the standard's own error", [percent(each) if each > 0 else "not known" for each in own])
    return wide


def _most_accurate(table: pd.DataFrame) -> pd.DataFrame:
    """Return of each scene the row with the least error of those that run in real time."""
    fast = tables.where(table[table["real_time_factor"] < 1], failures=0).dropna(subset="rmse_of_peak")
    return fast.loc[fast.groupby("scene", sort=False)["rmse_of_peak"].idxmin()]


def _meshes(first: pd.DataFrame, pressed: pd.DataFrame | None) -> tuple[list[dict[str, Any]], list[str]]:
    """Return how wrong the mesh of each standard is itself, and the scenes of which no press shows it."""
    scenes_of: dict[tuple[str, int, MeshError], list[str]] = {}
    unknown = []
    for row in first.itertuples():
        error_of_mesh = mesh_error(pressed, str(row.body), int(row.reference_level))
        if error_of_mesh is None:
            unknown.append(spaced(row.scene))
        else:
            scenes_of.setdefault((str(row.body), int(row.reference_level), error_of_mesh), []).append(spaced(row.scene))
    rows = [
        {"scenes": scenes, "body": body, "level": level} | error._asdict()
        for (body, level, error), scenes in scenes_of.items()
    ]
    return rows, unknown
