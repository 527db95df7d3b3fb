"""Write examples/palpation/slab_presses.csv: presses whose answer is known, from the truth of touch on a slab.

python tests/benchmarks/synthetic_presses.py --truth truth.npz; the truth takes minutes, and is kept in that file.

A bonded slab, 60 mm wide and 15 mm thick, under a ball of 5 mm that slides: the converged force of quadratic elements
in the whole slab, which has none of the assumptions of the models that are fitted. The rest is drawn: each press begins
late by an offset, tissue differs from place to place, relaxes by two branches, and forces have an error.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.benchmark.touch import BEFORE, Touch
from palpate.benchmark.touch_truth import truth_of_touches
from palpate.bodies.body import nest
from palpate.bodies.material import Material, Series
from palpate.bodies.simple_shapes import box
from palpate.effects.instrument import SPHERE, Instrument
from palpate.identification.hereditary import Branches

YOUNG_PA, POISSON, LAW = 4000.0, 0.45, "neo_hookean"
RADIUS_M, WIDE_M, THICK_M = 0.005, 0.06, 0.015
SHARES, TIMES_S = (0.3, 0.2), (0.4, 4.0)
"""Of the force's relaxation; the modulus above is the relaxed one."""
DEPTHS_M = (0.0005, 0.001, 0.0016, 0.0025)
PRESSES, SPREAD, NOISE, OFFSET_M = 8, 0.05, 0.02, (0.0, 0.0001)
SPEED_M_S, HOLD_S, STEP_S, FINER = 0.001, 8.0, 0.1, 20
OUT = Path(__file__).parents[2] / "examples/palpation/slab_presses.csv"


def truth(path: Path) -> tuple[np.ndarray, np.ndarray, float]:
    """Return depths [m], forces [N] and the largest own error of the force; from the file, if there is one."""
    if not path.is_file():
        mesh = box([WIDE_M, WIDE_M, THICK_M], [12, 12, 3])
        held = np.flatnonzero(mesh.nodes[:, 2] < 1e-9)
        body = nest("slab", mesh, 0, held, Material(YOUNG_PA, POISSON, 1000.0, LAW))
        top = np.flatnonzero(mesh.nodes[:, 2] > THICK_M - 1e-9)
        node = int(top[np.linalg.norm(mesh.nodes[top, :2] - 0.5 * WIDE_M, axis=1).argmin()])
        ball, down = Instrument(SPHERE, RADIUS_M), np.array([0.0, 0.0, -1.0])
        found = truth_of_touches(body, [Touch(ball, node, down, depth) for depth in DEPTHS_M])
        depth = np.outer(DEPTHS_M, (BEFORE, 1.0)).ravel()
        print(found.force, found.own, found.rejected)
        np.savez(path, depth_m=depth, force_n=found.force.ravel(), own=found.own[:, 0].max())
    kept = np.load(path)
    return kept["depth_m"], kept["force_n"], float(kept["own"])


def presses(depth_m: np.ndarray, force_n: np.ndarray, seed: int = 1) -> pd.DataFrame:
    """Draw the rows of the file from forces (k,) [N] at depths (k,) [m]."""
    rng, series = np.random.default_rng(seed), Series(SHARES, TIMES_S)
    smooth = np.polynomial.Polynomial.fit(depth_m, np.log(force_n / depth_m**1.5), 3)
    rows = []
    for number in range(PRESSES):
        offset, strength = rng.uniform(*OFFSET_M), np.exp(SPREAD * rng.normal())
        deepest = rng.uniform(0.6, 0.95) * max(DEPTHS_M) - offset
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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--truth", type=Path, default=Path("slab_truth.npz"))
    depth, force, own = truth(parser.parse_args().truth)
    print(f"own error of the truth's force: {own:.2%}")
    presses(depth, force).to_csv(OUT, index=False)
    print(f"wrote {OUT}")
