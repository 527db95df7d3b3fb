"""Tables of cuts, made up: elements and springs on two levels, a reduced one that is late, and one that fails."""

import io

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.ranking import TRUTH
from palpate.report.tables import columns

ANSWERS = [
    # model, level, way, setting, surface, opening, force, change [s], first [s]
    ("fem", 0, "split_faces", "", 0.2, 0.5, 0.3, 0.01, 0.02),
    ("fem", 1, "split_faces", "", 0.05, 0.3, 0.2, 0.1, 0.2),
    ("fem", 1, "conform", "", 0.01, 0.04, 0.05, 1.0, 2.0),
    ("springs", 0, "split_faces", "iterations=10", 0.3, 0.6, 0.3, 0.01, 0.01),
    ("springs", 1, "split_faces", "iterations=1", 0.12, 0.2, 0.2, 0.05, 0.06),
    ("springs", 1, "split_faces", "iterations=10", 0.1, 0.2, 0.2, 0.08, 0.1),
    ("linear_responses", 1, "virtual_nodes", "update=true", 0.07, 0.4, 0.5, 0.03, 0.04),
    ("enriched_responses", 0, "enriched", "order=2", 0.08, 0.1, 0.1, 0.01, 0.012),
    ("xpbd", 1, "virtual_nodes", "steps=20", np.nan, np.nan, np.nan, np.nan, np.nan),
]
SCENES = {"liver_cut": "liver", "pad_cut": "pad"}


def as_read(table: pd.DataFrame) -> pd.DataFrame:
    """The table as it is read from its file, where an empty text is none."""
    return pd.read_csv(io.StringIO(table.to_csv(index=False)))


@pytest.fixture
def cut() -> pd.DataFrame:
    rows = []
    for scene, body in SCENES.items():
        for model, level, way, more, *errors, change, first in ANSWERS:
            row = {"scene": scene, "body": body, "model": model, "level": level, "way": way, "calls": 5}
            row |= {"setting": ", ".join(filter(None, (f"level={level}", more))), "lost_share": 0.0, "offline_s": 0.1}
            for name, value in zip(("surface_error", "opening_error", "force_error"), errors, strict=True):
                row |= {name: value, f"own_{name}": 0.005}
            for time, value in (("change", change), ("first", first), ("again", 0.1 * first), ("step", first)):
                row |= {f"{time}_{part}_s": value for part in ("median", "p95", "max")}
            rows.append(row | {"failure": "" if np.isfinite(first) else "lost"})
    return as_read(pd.DataFrame(rows, columns=columns("cut")))


@pytest.fixture
def cut_truth() -> pd.DataFrame:
    """The truth of the pad is not believed."""
    rows = []
    for scene, body in SCENES.items():
        row = dict.fromkeys(columns("cut_truth"), 0.004) | {"scene": scene, "body": body, "nodes": 90000}
        row |= {"opening_m": 0.0042, "opening_error": 0.007, "seconds": 60.0, "front_ratio": 2.1, "rim_ratio": 1.9}
        rows.append(row | {"rejected": "the lips close (overlap 1 mm)" if body == "pad" else ""})
    return as_read(pd.DataFrame(rows, columns=columns("cut_truth")))


@pytest.fixture
def cut_opening(cut) -> pd.DataFrame:
    """The truth opens as an ellipse, each model less; the one that fails has no rows."""
    along = np.linspace(0.0, 0.03, 5)
    wide = 0.004 * np.sqrt(1.0 - ((along - 0.015) / 0.016) ** 2)
    labels = [{"scene": scene, "model": TRUTH, "setting": "", "level": "", "way": ""} for scene in SCENES]
    kept = ["scene", "model", "setting", "level", "way"]
    labels += cut[cut["failure"].isna()][kept].to_dict("records")
    rows = [
        each | {"along_m": a, "opening_m": w * (1.0 if each["model"] == TRUTH else 0.6)}
        for each in labels
        for a, w in zip(along, wide, strict=True)
    ]
    return as_read(pd.DataFrame(rows, columns=columns("cut_opening")))
