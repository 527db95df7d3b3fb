"""Record which state of the code a number came from.

Tabulate accuracy_vs_time: every setting of every model on every scene, and when its preparation has paid.
"""

import subprocess
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.benchmark.measure import SETTING_COLUMNS
from palpate.models.model_registry import SAVED_AGAINST


def commit() -> str:
    """Return the short commit of this package's source, with a + where files differ from it; or its version."""
    folder = Path(__file__).parents[1]
    words = ["git", "-C", str(folder), "describe", "--always", "--dirty=+", "--abbrev=12", "--exclude=*"]
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return version("palpate")


_BEFORE = SETTING_COLUMNS.index("threads")
COLUMNS = [*SETTING_COLUMNS[:_BEFORE], "break_even_queries", "threads", "commit", "failure"]


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
    return settings.assign(break_even_queries=queries, commit=commit)[COLUMNS]
