"""Tabulate accuracy_vs_time: every setting of every model on every scene, and when its preparation has paid."""

import numpy as np
import pandas as pd

from palpate.models.model_registry import SAVED_AGAINST

COLUMNS = [
    "scene", "body", "regime", "model", "setting", "protocol", "split", "samples", "failures",
    "rmse_m", "rmse_of_peak", "p95_of_peak", "max_of_peak", "online_median_s", "online_p95_s",
    "offline_s", "memory_mb", "break_even_queries", "threads", "commit", "failure",
]  # fmt: skip


def accuracy_vs_time(settings: pd.DataFrame, commit: str) -> pd.DataFrame:
    """Add to the rows of all settings after how many queries each has paid its preparation back.

    break_even_queries : offline_s over what a query saves against fine FEM; inf where it saves nothing
    """
    fine = settings[settings["model"] == SAVED_AGAINST].groupby("scene")["online_median_s"].last()
    saved = settings["scene"].map(fine) - settings["online_median_s"]
    queries = np.where(saved > 0, settings["offline_s"] / saved.where(saved > 0, 1.0), np.inf)
    return settings.assign(break_even_queries=queries, commit=commit)[COLUMNS]
