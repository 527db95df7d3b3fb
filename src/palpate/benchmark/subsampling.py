"""Take coarse samples from fine ones: paper 1's protocol, in which the coarse mesh is never simulated."""

from pathlib import Path

import h5py
import numpy as np

from palpate.bodies.body import Body
from palpate.errors import InputError
from palpate.files import read_hdf5, write_whole


def subsample(body: Body, fine: np.ndarray) -> np.ndarray:
    """Return the displacements (k, N, 3) [m] of the coarse nodes from those of all fine nodes, ``fine`` (k, n, 3) [m].

    Levels are nested and coarse nodes come first, so that this takes the first N nodes. InputError for another n.
    """
    if fine.shape[1:] != body.fine.nodes.shape:
        raise InputError(
            f"{body.name}: the fine responses have {fine.shape[1]} nodes and the fine mesh {len(body.fine.nodes)}; "
            "simulate them again."
        )
    return fine[:, : len(body.coarse.nodes)]


def save_subsampled(sample: np.ndarray, displacement: np.ndarray, path: Path | str) -> None:
    """Write sample numbers (k,) and coarse displacements (k, N, 3) [m] to HDF5, whole or not at all."""
    with write_whole(path) as temporary, h5py.File(temporary, "w") as file:
        file.create_dataset("sample", data=sample, fletcher32=True)
        file.create_dataset("displacement", data=displacement, fletcher32=True).attrs["unit"] = "m"


def load_subsampled(path: Path | str) -> tuple[np.ndarray, np.ndarray]:
    """Read what ``save_subsampled`` wrote."""
    with read_hdf5(path) as file:
        return file["sample"][:], file["displacement"][:]
