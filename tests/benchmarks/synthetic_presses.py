"""Write examples/palpation/slab_presses.csv, presses whose answer is known; run it from the repository's root.

A bonded slab 15 mm thick under a ball of 5 mm that slides: the exact force of a linear elastic layer, by an integral
equation that has nothing in common with the models that are fitted. The rest is drawn: each press begins late by an
offset, tissue differs from place to place, relaxes by two branches, and forces have an error.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).parents[1]))

from fixtures.indented_layer import indented, sphere

from palpate.bodies.material import Series
from palpate.identification.hereditary import Branches

YOUNG_PA, POISSON, RADIUS_M, THICK_M, WIDE_M = 4000.0, 0.45, 0.005, 0.015, 0.06
SHARES, TIMES_S = (0.3, 0.2), (0.4, 4.0)
"""Of the force's relaxation; the modulus above is the relaxed one."""
CONTACTS_M = np.linspace(0.0012, 0.0032, 12)
DEEPEST_M = 0.002
PRESSES, SPREAD, NOISE, OFFSET_M = 8, 0.05, 0.02, (0.0, 0.0001)
SPEED_M_S, HOLD_S, STEP_S, FINER = 0.001, 8.0, 0.1, 20
OUT = Path(__file__).parents[2] / "examples/palpation/slab_presses.csv"


def presses(seed: int = 1) -> pd.DataFrame:
    """Draw the rows of the file."""
    rng, series = np.random.default_rng(seed), Series(SHARES, TIMES_S)
    exact = [indented(sphere(RADIUS_M), contact, YOUNG_PA, POISSON, THICK_M) for contact in CONTACTS_M]
    depth_m, force_n = np.array(exact).T
    smooth = np.polynomial.Polynomial.fit(depth_m, np.log(force_n / depth_m**1.5), 3)
    rows = []
    for number in range(PRESSES):
        offset, strength = rng.uniform(*OFFSET_M), np.exp(SPREAD * rng.normal())
        deepest = rng.uniform(0.6, 0.95) * DEEPEST_M - offset
        times = STEP_S * np.arange(round(deepest / SPEED_M_S / STEP_S) + round(HOLD_S / STEP_S))
        depth = np.minimum(SPEED_M_S * times, deepest)
        begun, most = offset / SPEED_M_S, deepest + offset  # of the motion before the touch is noticed
        fine = np.append(np.arange(FINER * round(begun / STEP_S + 0.5), 0, -1) * -STEP_S / FINER, 0.0)
        fine = np.append(fine, np.linspace(0.0, times[-1], FINER * (len(times) - 1) + 1)[1:])
        way = np.clip(SPEED_M_S * fine + offset, 0.0, most)
        instant = strength * np.exp(smooth(way)) * way**1.5 / (1.0 - sum(SHARES))
        force = Branches(series).respond(fine, instant[:, None])[fine > -1e-12, 0][::FINER]
        force = force * (1.0 + NOISE * rng.normal(size=len(force)))
        at = WIDE_M * np.array([0.35 + 0.1 * (number % 4), 0.45 + 0.1 * (number // 4)])
        for row in zip(times, depth, force, strict=True):
            rows.append((f"p{number + 1}", *at.round(4), THICK_M, round(row[0], 2), round(row[1], 7), round(row[2], 5)))
    return pd.DataFrame(rows, columns=["press", "x_m", "y_m", "z_m", "time_s", "depth_m", "force_n"])


if __name__ == "__main__":
    presses().to_csv(OUT, index=False)
    print(f"wrote {OUT}")
