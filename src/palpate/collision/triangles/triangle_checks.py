"""What callers hand over: coordinates and node numbers, or a sentence about what is wrong with them."""

import numpy as np

from palpate.errors import InputError


def coordinates(values, shape: tuple, said: str) -> np.ndarray:
    """``values`` as contiguous float64 of the ``shape``, in which any length is None; else InputError of ``said``."""
    array = as_array(values)
    fits = len(array.shape) == len(shape) and all(n in (None, m) for n, m in zip(shape, array.shape, strict=True))
    if array.dtype.kind not in "biuf":
        raise InputError(f"{said} are not numbers; give coordinates in m.")
    if not fits:
        wanted = ", ".join("n" if n is None else str(n) for n in shape)
        raise InputError(f"{said} have shape {array.shape}; give ({wanted}) coordinates in m.")
    return np.ascontiguousarray(array, dtype=float)


def node_numbers(values, said: str) -> np.ndarray:
    """``values`` as contiguous int64 (m, 3); nothing at all is no triangles; else InputError of ``said``."""
    array = as_array(values)
    if array.shape == (0,):
        return np.empty((0, 3), np.int64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{said} have shape {array.shape}; give (m, 3) numbers of nodes.")
    if len(array) and array.dtype.kind not in "iu":
        raise InputError(f"{said} are of type {array.dtype}; give whole numbers of nodes.")
    return np.ascontiguousarray(array, dtype=np.int64)


def as_array(values) -> np.ndarray:
    """An array; of rows that differ in length, one of no numbers."""
    try:
        return np.asarray(values)
    except ValueError:
        return np.array("rows of different length")
