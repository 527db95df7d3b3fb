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
    unanswered = table[table["peak_of_size"].isna()]
    changes = [label(row.changed, row.law, row.poisson) for row in unanswered.itertuples()]
    return {"doubted": _doubted(table), "lost": unanswered.assign(what=changes), "summary": summary(table)}


def _doubted(table: pd.DataFrame) -> str:
    """List the changes whose truth is not believed, with its own error."""
    rows = table[~table["believed"].astype(bool) & table["own_rmse_of_peak"].notna()]
    groups = rows.groupby(VARIANT[1:], sort=False)["own_rmse_of_peak"]
    return listed([f"{label(*names)} ({span(errors)})" for names, errors in groups]) or "none"


def _from_which_depth(depths: pd.DataFrame) -> str:
    """Say from which depth on a change exceeds the error of one mesh, at the earliest and the latest contact."""
    extremes = [depths["from_depth"].min(), depths["from_depth"].max()] if len(depths) else [np.inf]
    earliest, *latest = dict.fromkeys(map(_depth_in_words, extremes))
    if not latest:
        return earliest
    return f"{earliest} at the earliest" + (f" and {latest[0]} at the latest" if np.isfinite(extremes[1]) else "")


def _depth_in_words(share: float) -> str:
    """Say a depth, as a share of the body's size, from which on a change exceeds an error; infinite for none."""
    if not np.isfinite(share):
        return "at no depth"
    return f"from {percent(share)} on" if share > 0.0 else "from the first depth on"


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Tabulate each body and change: the deepest presses, from which depth on they matter, and what they took."""
    rows, depths = [], from_depths(table).set_index(VARIANT)
    for names, presses in table.groupby(VARIANT, sort=False):
        deepest = presses[presses["depth_of_size"] == presses.groupby("contact")["depth_of_size"].transform("max")]
        row = {"body": spaced(names[0]), "changed to": label(*names[1:]) + (" (as it is)" if names[1] == OWN else "")}
        row |= {"depth [% of size]": 100 * deepest["depth_of_size"].mean()}
        row |= {"change [% of peak]": 100 * deepest["change_rmse_of_peak"].mean()}
        row |= {"at the patch [% of peak]": 100 * deepest["change_patch_rms_of_peak"].mean()}
        part = depths.loc[[names]] if names in depths.index else depths.iloc[:0]
        for mesh, name in MESHES.items():
            row |= {f"error of {name} [% of peak]": 100 * deepest[f"{mesh}_rmse_of_peak"].mean()}
            row |= {f"more than that of {name}": _from_which_depth(tables.where(part, mesh=mesh)) if len(part) else ""}
        row |= {"change of volume [%]": 100 * deepest["volume_change"].mean()}
        row |= {"least det F": deepest["least_det"].min()}
        row |= {"iterations": presses["iterations"].mean(), "cycles": presses["cycles"].mean()}
        rows.append(row | {"presses without an answer": int(presses["peak_of_size"].isna().sum())})
    return pd.DataFrame(rows)
