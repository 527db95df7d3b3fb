"""Tables of touches, made up: elements, a prepared model, one without a force, and one that fails."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.ranking import OWN_ERROR, TRUTH
from palpate.report.tables import columns

MODELS = [
    # model, setting, prepared, failures, surface, force, time [s]
    ("fem", "order=1, level=1", False, 0, 0.08, 0.6, 0.02),
    ("fem", "order=2, level=1", False, 0, 0.02, 0.2, 0.3),
    ("fem", "held=0, level=3", False, 0, 0.006, -0.03, 2.0),
    ("fem", "held=1, level=4", False, 0, 0.002, -0.01, 9.0),
    ("linear", "places=all", True, 0, 0.05, 0.09, 0.0004),
    ("linear", "places=few", True, 1, 0.06, 0.3, 0.0002),
    ("xpbd", "level=1", False, 0, 0.04, np.nan, 0.005),
    ("shape_matching", "clusters=one", False, 4, np.nan, np.nan, np.nan),
]
SCENES = {"liver_sphere_8mm": ("liver", "sphere", 0.008), "cylinder_punch_8mm": ("cylinder", "punch", 0.008)}


@pytest.fixture
def touch() -> pd.DataFrame:
    rows = []
    for scene, (body, instrument, radius) in SCENES.items():
        labels = {"scene": scene, "body": body, "instrument": instrument, "radius_m": radius, "samples": 4}
        own = {"model": TRUTH, "setting": OWN_ERROR, "failures": 0, "failure": ""}
        own |= {"rmse_of_peak": 0.001, "patch_rms_of_peak": 0.002, "force_error": 0.004}
        rows.append(labels | own | {"force_error_size": 0.004, "force_error_p95": 0.006})
        for model, setting, prepared, failures, surface, force, time in MODELS:
            row = labels | {"model": model, "setting": setting, "prepared": prepared, "failures": failures}
            row |= {"rmse_of_peak": surface, "patch_rms_of_peak": 3 * surface, "force_error": force}
            row |= {"force_error_size": abs(force), "force_error_p95": 1.5 * abs(force), "memory_mb": 1.0}
            row |= {
                "online_median_s": time,
                "online_max_s": 1.2 * time,
                "preparation_s": 2.0 * prepared,
                "offline_s": 1.0,
            }
            rows.append(row | {"failure": "lost" if failures else ""})
    return pd.DataFrame(rows, columns=columns("touch"))


@pytest.fixture
def touch_truth() -> pd.DataFrame:
    """The truth of the punch has lost a touch."""
    rows = []
    for scene, (body, instrument, radius) in SCENES.items():
        lost = int(instrument == "punch")
        row = dict.fromkeys(columns("touch_truth"), 0.004)
        row |= {"scene": scene, "body": body, "instrument": instrument, "radius_m": radius, "samples": 4 - lost}
        row |= {"rejected": lost, "why_rejected": "1 no answer on a mesh" if lost else "", "order": 2.0, "nodes": 50000}
        rows.append(row | {"force_error": 0.0042, "force_max_n": 0.12, "rmse_of_peak": 0.001, "seconds": 40.0})
    return pd.DataFrame(rows, columns=columns("touch_truth"))
