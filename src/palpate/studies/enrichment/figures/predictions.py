"""The methods' predictions for the test samples, as they are read from file."""

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from palpate.errors import InputError
from palpate.files import read_hdf5


@dataclass(frozen=True, eq=False)
class Prediction:
    """One method's predictions.

    sample : (s,) int, row numbers into the samples of the same body and regime's database
    predicted : (s, n, 3) float64 [m], displacement of the fine surface nodes
    """

    sample: np.ndarray
    predicted: np.ndarray


def read(path: str | Path, protocol: str, split: str, methods: list[str]) -> dict[str, Prediction]:
    """Read ``sample`` and ``predicted`` of the groups ``/{protocol}/{split}/{method}`` of a predictions.h5.

    Raises InputError naming the file and the group if one is missing or of a wrong shape.
    """
    with read_hdf5(path) as file:
        return {m: _one(file, f"{protocol}/{split}/{m}", path) for m in methods}


def _one(file: h5py.File, group: str, path) -> Prediction:
    if f"{group}/sample" not in file or f"{group}/predicted" not in file:
        raise InputError(f"{path}: group {group} lacks sample or predicted; delete the file and type make.")
    sample, predicted = file[f"{group}/sample"][:], file[f"{group}/predicted"][:]
    if predicted.ndim != 3 or predicted.shape[2] != 3 or len(sample) != len(predicted) or not len(sample):
        raise InputError(
            f"{path}: {group}/predicted has shape {predicted.shape} instead of ({len(sample)}, nodes, 3); "
            "delete the file and type make."
        )
    return Prediction(sample, predicted)
