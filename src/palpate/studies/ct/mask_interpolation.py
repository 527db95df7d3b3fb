"""Masks that are drawn on every n-th slice and filled between, against the whole mask (paper 3, chapter 2)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.scan_of import fill_between

NEAREST, BETWEEN = "nearest slice", "signed distance"


def measure(name: str, image: Image, mask: np.ndarray, every: Sequence[int]) -> pd.DataFrame:
    """Compute the rows of mask_interpolation.csv: how far the mask of a body comes back from every n-th slice.

    dice : 2 |a ∩ b| / (|a| + |b|), the lower of two ways to begin; volume_deviation : of the same, relative
    method : the mask of the nearest drawn slice, or interpolated signed distances (``fill_between``)
    Slices are drawn across z. An organ with fewer than two drawn ones has no row.
    """
    rows = []
    for n in every:
        for method in (NEAREST, BETWEEN):
            tried = [_compare(method, image, mask, only_every(mask, n, first)) for first in (0, n // 2)]
            found = [one for one in tried if one is not None]
            if found:
                rows.append((name, n, method, *min(found)))
    return pd.DataFrame(rows, columns=["body", "every", "method", "dice", "volume_deviation"])


def only_every(mask: np.ndarray, n: int, first: int) -> np.ndarray:
    """Keep every n-th slice of a mask, (nz, ny, nx) bool, counted from one of its own."""
    start = (int(np.flatnonzero(mask.any(axis=(1, 2)))[0]) + first) % n
    drawn = np.zeros_like(mask)
    drawn[start::n] = mask[start::n]
    return drawn


def dice(first: np.ndarray, second: np.ndarray) -> float:
    """Return how far two masks agree: 1 if they are the same, 0 if they have no voxel in common."""
    return float(2 * (first & second).sum() / (first.sum() + second.sum()))


def _compare(method: str, image: Image, mask: np.ndarray, drawn: np.ndarray) -> tuple[float, float] | None:
    slices = np.flatnonzero(drawn.any(axis=(1, 2)))
    if len(slices) < 2:
        return None
    if method == BETWEEN:
        filled = fill_between(drawn, image, "z", Path(image.source))
    else:
        half = (slices[1] - slices[0]) // 2
        all_of = np.arange(len(mask))
        near = slices[np.abs(all_of[:, None] - slices).argmin(axis=1)]
        filled = np.where((np.abs(all_of - near) <= half)[:, None, None], drawn[near], False)
    return dice(filled, mask), float(filled.sum() / mask.sum() - 1)
