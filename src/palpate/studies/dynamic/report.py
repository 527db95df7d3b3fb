"""Compare models in motion: the error of each over a whole scene, what a second of it costs, and what to take."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.advice import QUADRATIC, MeshError, mesh_error, parted
from palpate.benchmark.choosing import NONE
from palpate.report import tables
from palpate.report.advice_words import by_limit, say
from palpate.report.model_looks import label, look
from palpate.report.report import Report
from palpate.report.words import percent, spaced

TITLE = "Models in motion"


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    table, advice = report.tables["dynamic_accuracy"], report.tables.get("advice")
    names = {str(row["scene"]): _judged(row) for _, row in table.drop_duplicates("scene").iterrows()}
    bounds = report.tables.get("motion_bounds")
    moved = [] if bounds is None else tables.scenes(bounds)
    first = table.drop_duplicates("scene")
    true = first["reference"] == QUADRATIC
    limits = report.tables.get("motion_truth", pd.DataFrame(columns=["elements"]))
    told = np.isfinite(first["reference_error"])
    known, unknown = _meshes(first[~true & ~told], report.tables.get("accuracy_vs_time"))
    return {
        "truths": [f"{spaced(row.scene)} ({percent(row.reference_error)})" for row in first[true].itertuples()],
        "limits": len(limits),
        "apart": [
            f"{spaced(row.scene)} until {row.until_s:.2g} s ({percent(row.rmse_of_peak)})"
            if row.until_s
            else f"{spaced(row.scene)} at no time ({percent(row.rmse_of_peak)}, where it is pressed "
            f"{percent(row.patch_rms_of_peak)})"
            for row in tables.where(limits, elements="linear").itertuples()
        ],
        "best": [_most_accurate(tables.where(table, scene=scene)) for scene in names],
        "levels": [f"{spaced(row.scene)} {row.reference_level:g}" for row in first[~true].itertuples()],
        "meshes": known,
        "unknown_meshes": unknown,
        "taken": pd.DataFrame() if advice is None else _taken(advice[advice["scene"].isin(names)], names),
        "touched": "dynamic_force" in report.tables,
        "places": 0 if bounds is None else int(bounds["places"].max()),
        "moved": [spaced(scene) for scene in moved],
        "unmoved": [spaced(scene) for scene in names if scene not in moved],
        "bounds": pd.DataFrame() if bounds is None else _bounds(bounds),
    }


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


def _most_accurate(rows: pd.DataFrame) -> dict[str, Any]:
    """Return the model with the least error of those that need less than a second for a second of motion."""
    fast = tables.where(rows[rows["real_time_factor"] < 1], failures=0)
    found = {"scene": _judged(rows.iloc[0]), "model": "", "parted": parted(rows.iloc[0])}
    if fast.empty or found["parted"]:
        return found
    best = fast.loc[fast["rmse_of_peak"].idxmin()]
    return found | {"model": look(best["model"]).label, "error": best["rmse_of_peak"]}


def _meshes(first: pd.DataFrame, pressed: pd.DataFrame | None) -> tuple[list[dict[str, Any]], list[str]]:
    """Return how wrong the mesh of each standard is itself, and the scenes of which no press shows it."""
    known: dict[tuple[str, int, MeshError], list[str]] = {}
    unknown = []
    for row in first.itertuples():
        found = mesh_error(pressed, str(row.body), int(row.reference_level))
        if found is None:
            unknown.append(spaced(row.scene))
        else:
            known.setdefault((str(row.body), int(row.reference_level), found), []).append(spaced(row.scene))
    parts = [
        {"scenes": scenes, "body": body, "level": level} | error._asdict()
        for (body, level, error), scenes in known.items()
    ]
    return parts, unknown


def _bounds(found: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the bounds of motions elsewhere, by what each setting's error is estimated from."""
    return pd.DataFrame(
        {
            "scene": [spaced(scene) for scene in found["scene"]],
            "model": [label(row.model, row.setting) for row in found.itertuples()],
            "estimated from": found["estimate"].map({"constant": "nothing", "own": "its own motion"}),
            "places": found["places"],
            "error, median [% of peak]": 100 * found["error_of_peak"],
            "bound, median [% of peak]": 100 * found["bound_of_peak"],
            "bound over error": found["sharpness"],
            "rank correlation": found["rank_correlation"],
            "places below their bound [%]": 100 * found["coverage"],
        }
    )


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the settings that did not get through a scene: what, where, how."""
    table = report.tables["dynamic_accuracy"]
    for row in table[table["failures"] > 0].itertuples():
        yield label(row.model, row.setting), spaced(row.scene), "did not reach the end"
