"""Tabulate up to when the steps of a reference are resolved."""

import numpy as np
import pandas as pd

from palpate.studies.dynamic.dynamic_reference import Converged
from palpate.studies.dynamic.dynamic_trial import Trial


def tabulate(trial: Trial, found: Converged) -> pd.DataFrame:
    """Tabulate dynamic_reference.csv, a row a frame and halving of the step.

    Columns: step_s, the step that it came to; change_of_peak, what it changed the frame by, RMSE over the peak of all
    frames; bound; resolved, whether errors of models are taken at this frame.
    """
    times = trial.duration_s * np.arange(1, found.of_frames + 1) / found.of_frames
    parts = [
        pd.DataFrame({"step_s": step, "time_s": times, "change_of_peak": changes})
        for step, changes in zip(found.tried_s[2:], found.changes, strict=True)
    ]
    table = pd.concat(parts, ignore_index=True).assign(bound=found.bound)
    table["resolved"] = table["time_s"] <= found.duration_s * (1 + 1e-9)
    table.insert(0, "scene", trial.name)
    return table
