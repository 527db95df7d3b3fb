"""Pictures of a scan composited back to front and front to back, and the time of each (paper 3, chapter 2)."""

from functools import partial

import numpy as np
import pandas as pd

from palpate.benchmark.timing import time_calls
from palpate.bodies.ct.image import Image
from palpate.studies.ct.ray_casting import Field, Rays, cast
from palpate.studies.ct.tissue_classes import TISSUES, Transfer, fit_mixture, probabilities, transfer_of

BACK, FRONT = "back to front", "front to back"
ORDERS = ((BACK, 1.0), (FRONT, 1.0), (FRONT, 0.99))
"""Order of compositing, and the opacity at which a ray ends; at 1 no ray does."""
GREY = np.arange(-1100.0, 1501.0, 4.0)
"""Grey values [HU] at which looks are tabulated."""
REPEATS = 5
"""Timed pictures; each takes some tenths of a second."""
TRANSLUCENT, SOLID = "translucent", "solid"
_SOLID = 10.0
"""Times as many layers of a tissue lie in a millimetre where tissues look solid."""


def measure(field: Field, rays: Rays, transfer: Transfer) -> pd.DataFrame:
    """Compute the rows of compositing.csv.

    looks : with the opacities of ``transfer``, or as if tissues were ten times as dense; order, enough : one of ORDERS;
    samples : of a ray, mean over the picture; median_s : time of a picture, made in turn with the others;
    difference : largest difference of a colour, 0 to 1, from the picture that is composited back to front
    """
    rows = []
    for looks, shown in ((TRANSLUCENT, transfer), (SOLID, solid(transfer))):
        calls = [
            partial(cast, field, shown, rays, back_to_front=order == BACK, enough=enough) for order, enough in ORDERS
        ]
        taken = [call() for call in calls]
        exact = on_white(taken[0][0])
        timed = time_calls(calls, REPEATS).seconds
        for (order, enough), (found, samples), seconds in zip(ORDERS, taken, timed, strict=True):
            apart = float(abs(on_white(found) - exact).max())
            rows.append((looks, order, enough, float(samples.mean()), float(np.median(seconds)), apart))
    return pd.DataFrame(rows, columns=["looks", "order", "enough", "samples", "median_s", "difference"])


def solid(transfer: Transfer) -> Transfer:
    """Return looks of tissues ten times as dense."""
    return transfer._replace(per_mm=1 - (1 - transfer.per_mm) ** _SOLID)


def on_white(found: np.ndarray) -> np.ndarray:
    """Put colours times opacity, and opacity, (n, 4), on white: (n, 3), 0 to 1."""
    return found[:, :3] + (1 - found[:, 3:])


def likely(image: Image) -> Transfer:
    """Return the looks of a CT's grey values by the probability of each tissue, fitted to its histogram."""
    mixture = fit_mixture(image.hu, [tissue.hu for tissue in TISSUES])
    return transfer_of(GREY, probabilities(mixture, GREY))
