"""Livers that are segmented from a CT and from an MRI by their grey values, against the truth (paper 3, chapter 2)."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.scan_of import even_brightness
from palpate.bodies.ct.segmentation import segment
from palpate.bodies.ct.synthetic_abdomen import LIVER_SIGNALS, mri_abdomen
from palpate.errors import InputError
from palpate.studies.ct.mask_interpolation import dice

CT_RANGE = (30, 120)


def measure(ct: Image, liver: np.ndarray) -> tuple[pd.DataFrame, list[tuple[Image, np.ndarray]]]:
    """Compute the rows of segmented_scans.csv, and the MRI as it is and evened with what is found in each.

    ct, liver : the synthetic abdomen and its liver, (nz, ny, nx) bool
    scan : what the grey values are of; dice, volume_deviation : of the segmentation by one range of grey values. Where
    nothing is found, dice is 0.
    """
    raw = mri_abdomen(spacing_m=ct.spacing_m.tolist())[0]
    rows, shown = [], []
    for scan, image in (("CT", ct), ("MRI", raw), ("MRI, evened", even_brightness(raw))):
        found = _segmented(image, CT_RANGE if image.modality == "ct" else LIVER_SIGNALS)
        volume = float(found.sum() / liver.sum() - 1)
        rows.append((scan, dice(found, liver), volume))
        if image.modality == "mri":
            shown.append((image, found))
    return pd.DataFrame(rows, columns=["scan", "dice", "volume_deviation"]), shown


def _segmented(image: Image, limits: Sequence[float]) -> np.ndarray:
    try:
        return segment(image, {"threshold_hu": limits, "threshold": limits})
    except InputError:
        return np.zeros(image.hu.shape, dtype=bool)
