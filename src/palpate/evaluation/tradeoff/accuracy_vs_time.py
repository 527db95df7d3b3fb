"""The table accuracy_vs_time: every model's knobs on every scene, and after how many queries each has paid back."""

import numpy as np
import pandas as pd

from palpate.models.model_registry import SAVED_AGAINST

COLUMNS = [
    "scene", "body", "regime", "model", "knob", "protocol", "split", "samples", "failures",
    "rmse_m", "rmse_of_peak", "p95_of_peak", "max_of_peak", "online_median_s", "online_p95_s",
    "offline_s", "memory_mb", "break_even_queries", "threads", "commit", "failure",
]  # fmt: skip


def accuracy_vs_time(knobs: pd.DataFrame, commit: str) -> pd.DataFrame:
    """Rows of accuracy_vs_time.csv from those of every model's knobs.

    break_even_queries : offline_s over what a query saves against fine FEM; inf where it saves nothing
    """
    fine = knobs[knobs["model"] == SAVED_AGAINST].groupby("scene")["online_median_s"].last()
    saved = knobs["scene"].map(fine) - knobs["online_median_s"]
    queries = np.where(saved > 0, knobs["offline_s"] / saved.where(saved > 0, 1.0), np.inf)
    return knobs.assign(break_even_queries=queries, commit=commit)[COLUMNS]
