"""The state of a search on disk, so that one that was stopped can go on."""

import json
import zipfile
from pathlib import Path

import numpy as np

from palpate.files import write_whole


def save(path: Path, mark: np.ndarray, state: dict) -> None:
    """Write ``state``, arrays and the state of a generator ``random``, with the ``mark`` of what it belongs to."""
    arrays = {name: value for name, value in state.items() if name != "random"}
    with write_whole(path) as part, open(part, "wb") as file:
        np.savez(file, mark=mark, random=json.dumps(state["random"]), **arrays)


def load(path: Path, mark: np.ndarray, like: dict) -> dict | None:
    """What ``save`` wrote, or None: a search then starts anew.

    None if it is not there, is damaged, has another ``mark`` or does not hold what the state ``like`` does: arrays of
    the same names, shapes and kinds (``history`` may be longer), without NaN, and the state of a generator.
    """
    try:
        with np.load(path) as file:
            state = {name: file[name] for name in file.files}
        if not np.array_equal(state.pop("mark"), mark) or state.keys() != like.keys():
            return None
        random = state["random"] = json.loads(str(state["random"]))
        np.random.default_rng().bit_generator.state = random
        arrays = [(name, like[name], state[name]) for name in like if name != "random"]
        return state if all(_alike(name, *pair) for name, *pair in arrays) else None
    except (OSError, ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def _alike(name: str, wanted: np.ndarray, found: np.ndarray) -> bool:
    free = int(name == "history")  # grows by a line a generation
    return (
        found.dtype == wanted.dtype
        and found.ndim == wanted.ndim
        and found.shape[free:] == wanted.shape[free:]
        and found.size > 0
        and not np.isnan(found).any()
    )
