"""Name the settings that follow a cut, and put finite elements beside springs."""

from typing import Any

import pandas as pd

from palpate.report.model_looks import look
from palpate.report.report import Report
from palpate.report.words import percent, seconds
from palpate.studies.cut.claims import compared
from palpate.studies.cut.figures import FRAMES_MS, PANELS, WAYS, way_of


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its tables: settings in words, times of frames [s], and pairs of models."""
    cut = report.tables["cut"]
    words = [f"{look(row['model']).label}, {way_of(row)[0]}" for _, row in cut.iterrows()]
    pairs = compared(cut)
    return {
        "cut": cut.assign(words=words, failure=cut["failure"].fillna("")).sort_values("surface_error", kind="stable"),
        "frames_s": [1e-3 * frame for frame in FRAMES_MS],
        "pairs": pairs.assign(way=[WAYS[way][0] for way in pairs["way"]], **_beside(pairs)),
    }


def _beside(pairs: pd.DataFrame) -> dict[str, list[str]]:
    """Write errors and times of finite elements, and in brackets those of springs."""
    writers = dict.fromkeys(PANELS, percent) | dict.fromkeys(("change_median_s", "first_median_s"), seconds)
    return {
        name: [
            f"{write(ours) if ours == ours else 'failed'} ({write(springs)})"
            for ours, springs in zip(pairs[name], pairs[f"springs_{name}"], strict=True)
        ]
        for name, write in writers.items()
    }
