"""Records of markers: CSV files of times and places, as a motion capture writes them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.errors import InputError

GAPS = 0.1
"""Share of the times at which a marker may be hidden: its places there are interpolated."""


@dataclass(frozen=True, eq=False)
class Record:
    """Places (n, m, 3) [m] of m markers at ``times`` (n,) [s], in the frame of the file ``name``."""

    name: str
    times: np.ndarray
    places: np.ndarray

    def mean(self, begin: float, end: float) -> np.ndarray:
        """Return the mean places (m, 3) [m] from ``begin`` to ``end`` [s]; InputError if there are none."""
        within = (self.times >= begin - 1e-9) & (self.times <= end + 1e-9)
        if not within.any():
            raise InputError(f"{self.name} has no row from {begin:g} to {end:g} s; correct held_s or settled_s.")
        return self.places[within].mean(axis=0)


def read_record(path: str | Path, markers: list[str]) -> Record:
    """Read the columns ``time_s`` and ``<marker>_x_m``, ``_y_m`` and ``_z_m`` of each marker; others are ignored.

    Empty cells are places where a marker was hidden, and are interpolated. Raises InputError, naming file, column and
    remedy, if a column is missing or no number, if times do not increase, or if more than GAPS of a marker are empty.
    """
    try:
        table = pd.read_csv(path)
    except (OSError, pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is no table ({' '.join(str(error).split())}); give a CSV file.") from error
    wanted = ["time_s", *(f"{marker}_{axis}_m" for marker in markers for axis in "xyz")]
    for column in wanted:
        if column not in table:
            raise InputError(
                f"{path} lacks the column {column}; give time_s and, for each marker of the entry, "
                "its name and _x_m, _y_m and _z_m."
            )
        if not pd.api.types.is_numeric_dtype(table[column]):
            raise InputError(f"{path} has a cell in the column {column} that is no number; correct it.")
    values = table[wanted].to_numpy(dtype=float)
    times = values[:, 0]
    if len(times) < 2 or not (np.diff(times) > 0.0).all():
        raise InputError(f"{path} has times that do not increase, or fewer than two; sort its rows by time_s.")
    for place, name in enumerate(wanted[1:], start=1):
        values[:, place] = _filled(times, values[:, place], f"{path}: {name}")
    return Record(str(path), times, values[:, 1:].reshape(len(times), len(markers), 3))


def _filled(times: np.ndarray, values: np.ndarray, place: str) -> np.ndarray:
    """Interpolate what is not finite, in time."""
    seen = np.isfinite(values)
    if not seen.mean() >= 1.0 - GAPS:
        raise InputError(f"{place} is empty in {1 - seen.mean():.0%} of the rows; leave out the marker, or fill it.")
    return values if seen.all() else np.interp(times, times[seen], values[seen])
