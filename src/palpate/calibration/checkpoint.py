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


def load(path: Path, mark: np.ndarray) -> dict | None:
    """What ``save`` wrote, or None if it is not there, damaged, or has another ``mark``: a search then starts anew."""
    try:
        with np.load(path) as file:
            state = {name: file[name] for name in file.files}
        same = np.array_equal(state.pop("mark"), mark)
        return state | {"random": json.loads(str(state["random"]))} if same else None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
