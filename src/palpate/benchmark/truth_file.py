"""Write and read truth.h5."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from palpate.benchmark.truth import OWN, Truth
from palpate.files import read_hdf5, write_whole

ARRAYS = (
    "sample", "contact", "displacement", "levels", "ratio", "order", "least_det", "volume_change", "iterations",
    "products", "seconds",
)  # fmt: skip
SIZES = ("level", "elements", "nodes", "radius_m")


def save_truth(truth: Truth, path: Path | str) -> None:
    """Write to HDF5, whole or not at all; each field of ``own`` as own_<name>, the reasons as text."""
    with write_whole(path) as temporary, h5py.File(temporary, "w") as file:
        for name in ARRAYS:
            file.create_dataset(name, data=getattr(truth, name), compression="gzip", fletcher32=True)
        for name, values in zip(OWN, truth.own.T, strict=True):
            file.create_dataset(f"own_{name}", data=values, fletcher32=True)
        file.create_dataset("rejected", data=[str(why) for why in truth.rejected], dtype=h5py.string_dtype())
        for name in ("displacement", "levels"):
            file[name].attrs["unit"] = "m"
        file.attrs.update({name: getattr(truth, name) for name in SIZES})


def load_truth(path: Path | str) -> Truth:
    """Read what ``save_truth`` wrote; InputError if it is missing or damaged."""
    with read_hdf5(path) as file:
        arrays = {name: file[name][:] for name in ARRAYS}
        own = np.stack([file[f"own_{name}"][:] for name in OWN], axis=1)
        sizes: dict[str, Any] = {name: file.attrs[name].item() for name in SIZES}
        rejected = np.array(file["rejected"].asstr()[:], dtype=object)
        return Truth(**arrays, own=own, rejected=rejected, **sizes)
