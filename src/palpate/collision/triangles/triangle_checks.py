"""Checks of the coordinates and node numbers that callers pass."""

import numpy as np
from numpy.typing import ArrayLike

from palpate.errors import InputError


def coordinates(values: ArrayLike, shape: tuple, name: str) -> np.ndarray:
    """Return ``values`` as contiguous float64 of the ``shape``, in which None is any length.

    Raises InputError, naming ``name``, if they are not numbers or have another shape.
    """
    array = as_array(values)
    fits = len(array.shape) == len(shape) and all(n in (None, m) for n, m in zip(shape, array.shape, strict=True))
    if array.dtype.kind not in "biuf":
        raise InputError(f"{name} are not numbers; give coordinates in m.")
    if not fits:
        wanted = ", ".join("n" if n is None else str(n) for n in shape)
        raise InputError(f"{name} have shape {array.shape}; give ({wanted}) coordinates in m.")
    return np.ascontiguousarray(array, dtype=float)


def node_numbers(values: ArrayLike, name: str) -> np.ndarray:
    """Return ``values`` as contiguous int64 (m, 3); an empty list gives an empty array.

    Raises InputError, naming ``name``, for another shape or type.
    """
    array = as_array(values)
    if array.shape == (0,):
        return np.empty((0, 3), np.int64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{name} have shape {array.shape}; give (m, 3) numbers of nodes.")
    if len(array) and array.dtype.kind not in "iu":
        raise InputError(f"{name} are of type {array.dtype}; give whole numbers of nodes.")
    return np.ascontiguousarray(array, dtype=np.int64)


def as_array(values: ArrayLike) -> np.ndarray:
    """Convert to an array; rows of different lengths become an array of text."""
    try:
        return np.asarray(values)
    except ValueError:
        return np.array("rows of different length")
