"""Checkpoint of a search on disk, from which a stopped search continues."""

import json
import zipfile
from pathlib import Path

import numpy as np

from palpate.files import write_whole


def save(path: Path, key: np.ndarray, state: dict) -> None:
    """Write ``state``, arrays and the state of a generator ``random``, with the ``key`` of the search it belongs to."""
    arrays = {name: value for name, value in state.items() if name != "random"}
    with write_whole(path) as part, open(part, "wb") as file:
        np.savez(file, key=key, random=json.dumps(state["random"]), **arrays)


def load(path: Path, key: np.ndarray, like: dict) -> dict | None:
    """Load what ``save`` wrote; return None if it cannot be used, so that the search starts anew.

    None if it is missing, damaged, has another ``key`` or does not have the contents of the state ``like``: arrays of
    the same names, shapes and types (``history`` may be longer), without NaN, and the state of a generator.
    """
    try:
        with np.load(path) as file:
            state = {name: file[name] for name in file.files}
        if not np.array_equal(state.pop("key"), key) or state.keys() != like.keys():
            return None
        random = state["random"] = json.loads(str(state["random"]))
        np.random.default_rng().bit_generator.state = random
        arrays = [(name, like[name], state[name]) for name in like if name != "random"]
        return state if all(_same_layout(name, *pair) for name, *pair in arrays) else None
    except (OSError, ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def _same_layout(name: str, wanted: np.ndarray, found: np.ndarray) -> bool:
    free = int(name == "history")  # grows by a row per generation
    return (
        found.dtype == wanted.dtype
        and found.ndim == wanted.ndim
        and found.shape[free:] == wanted.shape[free:]
        and found.size > 0
        and not np.isnan(found).any()
    )
