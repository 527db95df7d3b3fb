"""Tissues that voxels are taken for, against what the synthetic abdomen is made of (paper 3, chapter 2)."""

import numpy as np
import pandas as pd

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.synthetic_abdomen import hu_of_shapes, shape_shares
from palpate.studies.ct.tissue_classes import (
    TISSUES,
    by_percentage,
    by_threshold,
    fit_mixture,
    probabilities,
    thresholds,
)


def measure(image: Image) -> pd.DataFrame:
    """Compute the rows of tissue_classes.csv for the synthetic abdomen's CT ``image``.

    method : thresholds midway between usual grey values; the probability of a mixture that is fitted to the histogram;
    or the percentages of two neighbouring tissues. wrong : share of the voxels whose most likely tissue is not the one
    that fills most of them; rms_error : of the shares of all tissues, over the voxels
    """
    truth = _shares(image)
    mixture = fit_mixture(image.hu, [tissue.hu for tissue in TISSUES])
    methods = {
        "threshold": by_threshold,
        "probability": lambda grey: probabilities(mixture, grey),
        "percentage": by_percentage,
    }
    rows = []
    for method, classify in methods.items():
        found = classify(image.hu.astype(np.float32))
        for k, tissue in enumerate(TISSUES):
            within = truth.argmax(axis=0) == k
            error = float(np.sqrt(((found - truth)[k] ** 2).mean()))
            rows.append((method, tissue.name, float((found.argmax(axis=0) != k)[within].mean()), error))
    return pd.DataFrame(rows, columns=["method", "tissue", "wrong", "rms_error"])


def _shares(image: Image) -> np.ndarray:
    """Return the share of each tissue in each voxel, (k, nz, ny, nx); what no shape fills is a gap."""
    shares = shape_shares(image.spacing_m.tolist())
    truth = np.zeros((len(TISSUES), *image.hu.shape), dtype=np.float32)
    for name, hu in hu_of_shapes().items():
        truth[np.searchsorted(thresholds(), hu)] += shares[name]
    truth[0] += 1 - truth.sum(axis=0)
    return truth
