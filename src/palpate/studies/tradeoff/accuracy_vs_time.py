"""Tabulate accuracy_vs_time: every setting of every model on every scene, and when its preparation has paid."""

import subprocess
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.models.model_registry import SAVED_AGAINST
from palpate.table_declaration import Table


def commit() -> str:
    """Return the short commit of this package's source, with a + where files differ from it; or its version."""
    folder = Path(__file__).parents[1]
    words = ["git", "-C", str(folder), "describe", "--always", "--dirty=+", "--abbrev=12", "--exclude=*"]
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return version("palpate")


ACCURACY_VS_TIME = Table(
    "accuracy_vs_time",
    "The error against the truth, the time, the preparation and the memory of every model at each of its settings.",
    """
    scene body regime: a body under a regime of loads
    model setting: what answers
    sees prepared law protocol: what it is given, whether its contacts were prepared, its law, and the coarse answers
    split samples failures: number of the split of the contacts, test samples, and those without an answer
    rejected rejected_answered: validation and test samples without a truth, and those of them that it answered without
        a doubt or a failure
    rmse_m rmse_of_peak relative_l2 p95_of_peak max_of_peak: mean errors over the surface [m, peak, -, peak, peak]
    patch_rms_of_peak patch_max_of_peak: mean errors at the disc that is pressed [peak]
    operator_rmse_of_peak: error against the finest mesh alone [peak]
    rmse_of_peak_median rmse_of_peak_p95 relative_l2_median relative_l2_p95: median and 95th percentile of samples
    patch_rms_of_peak_median patch_rms_of_peak_p95 patch_max_of_peak_median patch_max_of_peak_p95: the same at the disc
    validation_rmse_of_peak validation_patch_rms_of_peak: mean errors on the samples that choose settings
    online_median_s online_p95_s online_max_s: time of an answer, and of the slowest press (median of its calls) [s]
    offline_s memory_mb: preparation [s], and memory [1e6 bytes]
    break_even_queries: answers after which the preparation has paid, against quadratic elements
    threads commit failure: threads, commit of the code, and the first reason of a failure
    """,
)


def accuracy_vs_time(settings: pd.DataFrame, commit: str) -> pd.DataFrame:
    """Add to the rows of all settings after how many queries each has paid its preparation back.

    break_even_queries : offline_s over what a query saves against fine FEM in the same split; inf where it saves
        nothing
    """
    whose = ["scene", "split"]
    fine = settings[settings["model"] == SAVED_AGAINST].groupby(whose)["online_median_s"].last()
    against = settings[whose].merge(fine.rename("fine"), left_on=whose, right_index=True, how="left")["fine"]
    saved = against.to_numpy() - settings["online_median_s"].to_numpy()
    queries = np.where(saved > 0, settings["offline_s"] / np.where(saved > 0, saved, 1.0), np.inf)
    return settings.assign(break_even_queries=queries, commit=commit)[ACCURACY_VS_TIME.columns]
