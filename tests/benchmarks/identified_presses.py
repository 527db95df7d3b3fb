"""How often the intervals of ``palpate identify`` hold the truth: presses drawn from known tissue, fitted again.

    python tests/benchmarks/identified_presses.py --draws 40 --processes 2

E, ν, thickness (unknown in every second draw, else none), offsets and places are drawn anew for each; a 90 % interval
should hold 85 to 95 % of truths.
"""

import argparse
import sys
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from fixtures.pressed_layer import THICKNESS_M, Layer, draw_presses

from palpate.identification.fit import Data, MixedModel, Options, best_fit
from palpate.identification.forward import Parameter
from palpate.identification.intervals import Profiler

NU = Parameter("poisson", 0.3, 0.49, "1")
THICKNESS = Parameter("thickness_m", *THICKNESS_M, "m")


def one(number: int, radius_m: float, noise: float) -> dict[str, tuple[float, float, float, float]]:
    """Return truth, low, best and high of each unknown of the draw ``number``."""
    rng = np.random.default_rng([number, round(1e6 * radius_m)])
    free = (NU, THICKNESS) if number % 2 else (NU,)
    layer = Layer(radius_m, free)
    values = {p.name: float(np.exp(rng.uniform(np.log(p.low), np.log(p.high)))) for p in free}
    young = float(np.exp(rng.uniform(np.log(1e3), np.log(1e4))))
    records = draw_presses(layer, values, rng, young, noise=noise)
    model = MixedModel.of(Data.of(records), layer, Options())
    best, least = best_fit(model)
    profiler = Profiler.of(model, best, least, 0.9)
    found = {"young_pa": (young, *profiler.young_pa()[0][:3])}
    found["modulus_pa"] = (young / (1.0 - values["poisson"] ** 2), *profiler.modulus_pa()[0][:3])
    for name, value in values.items():
        found[name] = (value, *profiler.parameter(name)[0][:3])
    found["offset_m"] = (-1e-4, *profiler.offset_m()[0][:3])
    return found


def main() -> None:
    """Print a line for each unknown: share of intervals that hold it, and their width."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=40)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--noise", type=float, default=0.02)
    asked = parser.parse_args()
    with ProcessPoolExecutor(asked.processes) as pool:
        for radius_m in (0.004, 0.008):
            kept = defaultdict(list)
            for found in pool.map(partial(one, radius_m=radius_m, noise=asked.noise), range(asked.draws)):
                for name, answer in found.items():
                    kept[name].append(answer)
            for name, answers in kept.items():
                truth, low, best, high = np.array(answers).T
                print(
                    f"{1e3 * radius_m:g} mm: {name:12} in the interval {np.mean((low <= truth) & (truth <= high)):.3f} "
                    f"of {len(truth)}; median width {np.median((high - low) / np.abs(best)):.3f}; median bias "
                    f"{np.median(best / truth - 1):+.3f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
