"""What the run of a scene leaves behind: positions and energies over time."""

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pandas as pd

from palpate.errors import InputError
from palpate.files import write_whole

ARRAYS = ("times", "positions", "rest", "triangles", "tetrahedra", "held")


@dataclass(frozen=True, eq=False)
class Motion:
    """A scene over time, in f frames.

    times : (f,) [s]; positions : (f, n, 3) and rest : (n, 3) [m]
    triangles : (t, 3) of the surface; tetrahedra : (m, 4), if any; held : (k,) nodes held still
    energy : one row a frame: time_s, kinetic_j, one column ``<effect>_j`` an energy, outer_work_j, total_j
    """

    scene: str
    times: np.ndarray
    positions: np.ndarray
    rest: np.ndarray
    triangles: np.ndarray
    tetrahedra: np.ndarray
    held: np.ndarray
    energy: pd.DataFrame


def save(motion: Motion, path: Path | str) -> None:
    """Write to HDF5, whole or not at all."""
    with write_whole(path) as part, h5py.File(part, "w") as file:
        file.attrs["scene"] = motion.scene
        for name in ARRAYS:
            file.create_dataset(name, data=getattr(motion, name), fletcher32=True)
        for name, values in motion.energy.items():
            file.create_dataset(f"energy/{name}", data=values)
        file.attrs["energy"] = list(motion.energy)


def load(path: Path | str) -> Motion:
    """Read what ``save`` wrote; InputError if the file is missing or damaged."""
    try:
        with h5py.File(path, "r") as file:
            energy = pd.DataFrame({name: file[f"energy/{name}"][()] for name in file.attrs["energy"]})
            return Motion(str(file.attrs["scene"]), *(file[name][()] for name in ARRAYS), energy)
    except (OSError, KeyError) as error:
        raise InputError(f"{path}: not a whole motion file ({error}); delete it and run make again.") from error
