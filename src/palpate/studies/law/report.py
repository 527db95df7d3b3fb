"""Tabulate what the choice of the law changes, beside the error of the mesh."""

from typing import Any

import numpy as np
import pandas as pd

from palpate.report import tables
from palpate.report.report import Report
from palpate.report.words import listed, percent, spaced, span
from palpate.studies.law.compare_laws import OWN, VARIANT, from_depths
from palpate.studies.law.figures import label

MESHES = {
    "own": "the truth",
    "finest": "quadratic elements on the finest mesh",
    "quadratic": "quadratic elements with the nodes of linear ones",
    "linear": "linear elements on the finest mesh",
}
"""The meshes whose errors are known, best first."""


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its table."""
    table = report.tables["law"]
    lost = table[table["peak_of_size"].isna()]
    whats = [label(row.changed, row.law, row.poisson) for row in lost.itertuples()]
    return {"doubted": _doubted(table), "lost": lost.assign(what=whats), "summary": summary(table)}


def _doubted(table: pd.DataFrame) -> str:
    """List the changes whose truth is not believed, with its own error."""
    rows = table[~table["believed"].astype(bool) & table["own_rmse_of_peak"].notna()]
    groups = rows.groupby(VARIANT[1:], sort=False)["own_rmse_of_peak"]
    return listed([f"{label(*names)} ({span(own)})" for names, own in groups]) or "none"


def _from_which_depth(depths: pd.DataFrame) -> str:
    """Describe from which depth on changes matter more than one mesh, from the earliest to the latest of them."""
    ends = [depths["from_depth"].min(), depths["from_depth"].max()] if len(depths) else [np.inf]
    first, *latest = dict.fromkeys(map(_depth_in_words, ends))
    if not latest:
        return first
    return f"{first} at the earliest" + (f" and {latest[0]} at the latest" if np.isfinite(ends[1]) else "")


def _depth_in_words(share: float) -> str:
    """Describe one depth from which on a change matters more."""
    if not np.isfinite(share):
        return "at no depth"
    return f"from {percent(share)} on" if share > 0.0 else "from the first depth on"


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Tabulate each body and change: the deepest presses, from which depth on they matter, and what they took."""
    rows, depths = [], from_depths(table).set_index(VARIANT)
    for names, part in table.groupby(VARIANT, sort=False):
        deepest = part[part["depth_of_size"] == part.groupby("contact")["depth_of_size"].transform("max")]
        row = {"body": spaced(names[0]), "changed to": label(*names[1:]) + (" (as it is)" if names[1] == OWN else "")}
        row |= {"depth [% of size]": 100 * deepest["depth_of_size"].mean()}
        row |= {"change [% of peak]": 100 * deepest["change_rmse_of_peak"].mean()}
        row |= {"at the patch [% of peak]": 100 * deepest["change_patch_rms_of_peak"].mean()}
        own = depths.loc[[names]] if names in depths.index else depths.iloc[:0]
        for mesh, name in MESHES.items():
            row |= {f"error of {name} [% of peak]": 100 * deepest[f"{mesh}_rmse_of_peak"].mean()}
            row |= {f"more than that of {name}": _from_which_depth(tables.where(own, mesh=mesh)) if len(own) else ""}
        row |= {"change of volume [%]": 100 * deepest["volume_change"].mean()}
        row |= {"least det F": deepest["least_det"].min()}
        row |= {"iterations": part["iterations"].mean(), "cycles": part["cycles"].mean()}
        rows.append(row | {"presses without an answer": int(part["peak_of_size"].isna().sum())})
    return pd.DataFrame(rows)
