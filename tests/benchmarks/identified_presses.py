"""How often the intervals of ``palpate identify`` hold the truth: presses drawn from known tissue, fitted again.

    python tests/benchmarks/identified_presses.py --draws 40 --processes 2
    python tests/benchmarks/identified_presses.py --wrong 1.33 --draws 20           # a thickness taken for known
    python tests/benchmarks/identified_presses.py --organ presses.npz --draws 40     # of organ_presses.py truth

E, ν, thickness (unknown in every second draw, else none), offsets and places are drawn anew for each; a 90 % interval
should hold 85 to 95 % of truths. On an organ forces are those of its truth at places drawn from all, for the Poisson's
ratios that it has; the fit knows the body, and the forces of its elements are computed once.
"""

import argparse
import os
import pickle
import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from palpate.run.job import kernel_cache

os.environ.setdefault("NUMBA_CACHE_DIR", str(kernel_cache()))  # read when numba is imported
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from fixtures.pressed_layer import THICKNESS_M, Layer, draw_presses
from organ_presses import CASES, liver
from scipy.interpolate import PchipInterpolator

from palpate.effects.instrument import Instrument
from palpate.identification.asked import POISSON, STICKING
from palpate.identification.fit import Data, MixedModel, Options, best_fit, fitted
from palpate.identification.force_table import natural
from palpate.identification.forward import Forward, Parameter, SlabForward
from palpate.identification.intervals import Profiler
from palpate.identification.on_body import MARGIN, OrganForward
from palpate.identification.presses import Press, PressRecords

NU = Parameter("poisson", 0.3, 0.49)
THICKNESS = Parameter("thickness_m", *THICKNESS_M)
RADII_M = (0.004, 0.008)
YOUNG_PA = (1e3, 1e4)
THICK_M, SLAB_ERROR = 0.015, 0.003
"""Of a layer that is fitted with a wrong thickness; relative error of the forward model of slabs."""
DEEPEST, POINTS = 0.68, 10
"""Of presses over the radius, so that with their first touch the truth goes as deep; points of a press."""
TOUCHED_M = (-1e-4, 1e-4)
"""Mean and deviation of first touch."""


class Answer(NamedTuple):
    """Whether an interval holds the truth, how wide it is, and how far its best value is off, both over the truth."""

    holds: bool
    width: float
    off: float


Answers = dict[str, Answer]
"""By name of what is unknown; ``open poisson`` holds where the likelihood falls at neither end of the range, and
``exponent``, of depth, above the law's, where the law is said to follow the presses."""


PLACES = np.linspace(-1.0, 1.0, 2001)


def scaled(parameter: Parameter, value: float) -> float:
    """Return where a value lies in the range of a parameter, −1 … 1."""
    return float(np.interp(value, [natural(parameter, place) for place in PLACES], PLACES))


def intervals(records: PressRecords, forward: Forward, truths: Mapping[str, float]) -> Answers:
    """Fit presses; return what is said of each unknown whose truth is given.

    An interval of the profile holds the truth if a fit with the truth held is likely enough, which one fit tells. The
    root of the rise is nearly straight, so that its end is known from there, too.
    """
    model = MixedModel.of(Data.of(records), forward, Options())
    best, least = best_fit(model)
    values, profiler = model.values(best), Profiler(model, best, least)
    free = {p.name: p for p in model.table.free}

    def rise(held: Mapping[str, float], young: float | None = None) -> float:
        return max(fitted(model, best, held, young)[1] - least, 1e-9)

    found = {}
    for name, truth in truths.items():
        own = 0.0
        if name in free:
            above, off = rise({name: scaled(free[name], truth)}), values[name] / truth - 1.0 if truth else values[name]
        elif name == "offset_m":
            low, high = model.offset_m
            above, off = rise({"offset": 2.0 * (truth - low) / (high - low) - 1.0}), values[name] / truth - 1.0
        elif name in ("young_pa", "modulus_pa"):
            own, whole = np.sqrt(profiler.rise) * forward.common_error, name == "young_pa"
            above = rise({}, np.log(truth)) if whole else rise({"log_modulus": np.log(truth)})
            off = (np.log(values["young_pa"]) if whole else best["log_modulus"]) - np.log(truth)
        else:
            continue
        half = np.hypot(abs(off) * np.sqrt(profiler.rise / above), own)
        found[name] = Answer(bool(above <= profiler.rise or abs(off) <= half), 2.0 * half, off)
    if "poisson" in free:
        found["open poisson"] = Answer(all(rise({"poisson": end}) <= profiler.rise for end in (-1.0, 1.0)), 0.0, 0.0)
    free_excess = replace(model, free_excess=True)
    unknown, least_free = fitted(free_excess, {"excess": 0.0} | best)
    above = max(fitted(free_excess, unknown, {"excess": 0.0})[1] - least_free, 1e-9)
    half = np.sqrt(profiler.rise) * np.hypot(unknown["excess"] / np.sqrt(above), forward.relative_error)
    found["exponent"] = Answer(bool(abs(unknown["excess"]) <= half), 2.0 * half, unknown["excess"])
    told = {"place": best["place"], "shape": best["shape"], "noise": np.exp(best["log_noise"])}
    return found | {f"fitted {name}": Answer(True, 0.0, float(value)) for name, value in told.items()}


def on_layer(number: int, radius_m: float, noise: float, wrong: float) -> Answers:
    """Return what is said of the draw ``number`` on a layer in closed form.

    wrong : 0, or the thickness that the fit takes for known, over the layer's, which is then THICK_M
    """
    rng = np.random.default_rng([number, round(1e6 * radius_m)])
    if wrong:
        records = draw_presses(Layer(radius_m, known={"thickness_m": THICK_M}), {"poisson": 0.45}, rng, noise=noise)
        layer = Layer(radius_m, relative_error=SLAB_ERROR, known={"thickness_m": wrong * THICK_M})
        return intervals(records, layer, {"modulus_pa": 2000.0 / (1.0 - 0.45**2)})
    free = (NU, THICKNESS) if number % 2 else (NU,)
    layer = Layer(radius_m, free)
    values = {p.name: float(np.exp(rng.uniform(np.log(p.low), np.log(p.high)))) for p in free}
    young = float(np.exp(rng.uniform(*np.log(YOUNG_PA))))
    records = draw_presses(layer, values, rng, young, noise=noise)
    truths = {"young_pa": young, "modulus_pa": young / (1.0 - values["poisson"] ** 2), **values, "offset_m": -1e-4}
    return intervals(records, layer, truths)


class Numbered:
    """A forward model of some of its presses, numbered anew."""

    def __init__(self, forward: Forward, numbers: np.ndarray):
        self._forward, self._numbers = forward, numbers
        self.parameters, self.relative_error = forward.parameters, forward.relative_error
        self.common_error, self.deepest_m = forward.common_error, forward.deepest_m

    def forces(self, press: int, depth_m: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Return the forces (k,) [N]; see ``Forward``."""
        return self._forward.forces(int(self._numbers[press]), depth_m, values)


class Organ:
    """The truth of a ball on an organ at many places, and the forward model that is fitted to presses drawn from it.

    cases : numbers of the truth's laws, which are drawn from; law : that is fitted
    known : whether the fit knows the organ; if not, it takes a half-space
    kept : folder of forces of models, so that they are computed once
    """

    def __init__(self, path: Path, ball: int, cases: list[int], law: str, known: bool, kept: Path):
        truth, self.radius_m, self.cases = np.load(path), RADII_M[ball], cases
        force, self._depth = truth["force"][cases, ball], np.append(0.0, truth["depth_m"][ball])
        self._there = np.flatnonzero(np.isfinite(force).all(axis=(0, 2)))
        # F^(2/3) is nearly straight
        self._curves = [
            [PchipInterpolator(self._depth, np.append(0.0, place) ** (2 / 3)) for place in case[self._there]]
            for case in force
        ]
        deepest = DEEPEST * self.radius_m
        self._presses = [
            Press(str(p), str(p), "", "", at, way, None, np.array([deepest]), np.zeros(1))
            for p, (at, way) in enumerate(zip(truth["at_m"], truth["direction"], strict=True))
        ]
        stiffening = (0.0, 20.0) if law == "exponential" else 0.0
        local = SlabForward(self.radius_m, MARGIN * deepest, law, None, POISSON, stiffening, STICKING, kept)
        self.forward: Forward = local
        file = kept / f"{law}_{1e3 * self.radius_m:g}mm.pickle"
        if known and file.exists():
            self.forward = pickle.loads(file.read_bytes())
        elif known:
            body, instrument = liver("neo_hookean", 0.4), Instrument("sphere", self.radius_m)
            self.forward = OrganForward(body, instrument, self._presses, local, law)
            file.write_bytes(pickle.dumps(self.forward))

    def draw(self, number: int, places: int, noise: float) -> tuple[PressRecords, Forward, dict[str, float]]:
        """Return presses, the forward model of them, and the truth."""
        rng = np.random.default_rng([number, round(1e6 * self.radius_m)])
        which = int(rng.integers(len(self.cases)))
        chosen = np.sort(rng.integers(len(self._there), size=places))  # as of an organ with many such places
        young = float(np.exp(rng.uniform(*np.log(YOUNG_PA))))
        depth = np.linspace(0.1, 1.0, POINTS) * DEEPEST * self.radius_m
        presses = []
        for i, k in enumerate(chosen):
            touched = rng.normal(*TOUCHED_M)
            into = np.clip(depth - touched, 0.0, self._depth[-1])
            force = young * self._curves[which][k](into) ** 1.5 * (1.0 + noise * rng.standard_normal(POINTS))
            of = self._presses[self._there[k]]
            presses.append(Press(f"{i}", f"{i}", "", "", of.at_m, of.direction, None, depth, force))
        poisson = CASES[self.cases[which]][1]
        truths = {"young_pa": young, "modulus_pa": young / (1.0 - poisson**2), "poisson": poisson, "sticking": 0.0,
                  "offset_m": TOUCHED_M[0]}  # fmt: skip
        records = PressRecords(Instrument("sphere", self.radius_m), tuple(presses), "drawn presses")
        return records, Numbered(self.forward, self._there[chosen]), truths


def on_organ(number: int, organ: Organ, places: int, noise: float) -> Answers:
    """Return what is said of the draw ``number`` on an organ."""
    return intervals(*organ.draw(number, places, noise))


def tell(radius_m: float, draws: Iterable[Answers]) -> None:
    """Print a line for each unknown: share of intervals that hold it, their width, and how far best values are off."""
    kept = defaultdict(list)
    for found in draws:
        for name, answer in found.items():
            kept[name].append(answer)
        print(".", end="", file=sys.stderr, flush=True)
    for name, answers in kept.items():
        holds, width, off = np.array(answers, dtype=float).T
        print(
            f"{1e3 * radius_m:g} mm: {name:14} holds {holds.mean():.3f} of {len(holds)}; median width "
            f"{np.median(width):.3f}; off: median {np.median(off):+.4f}, {off.min():+.4f} to {off.max():+.4f}",
            flush=True,
        )


def main() -> None:
    """Draw, fit and tell for both balls."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=40)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--noise", type=float, default=0.02)
    parser.add_argument("--wrong", type=float, default=0.0, help="thickness that a layer is fitted with, over its own")
    parser.add_argument("--organ", type=Path, help="the truth, of organ_presses.py")
    parser.add_argument("--cases", type=int, nargs="+", default=[0, 1], help="numbers of the truth's laws")
    parser.add_argument("--law", default="neo_hookean", help="that is fitted")
    parser.add_argument("--places", type=int, default=8, help="of a draw on the organ")
    parser.add_argument("--half-space", action="store_true", help="fit as if no organ were known")
    parser.add_argument("--kept", type=Path, default=Path("kept"), help="folder of the models' forces")
    asked = parser.parse_args()
    with ProcessPoolExecutor(asked.processes) as pool:
        for ball, radius_m in enumerate(RADII_M):
            one = partial(on_layer, radius_m=radius_m, noise=asked.noise, wrong=asked.wrong)
            if asked.organ is not None:
                organ = Organ(asked.organ, ball, asked.cases, asked.law, not asked.half_space, asked.kept)
                one = partial(on_organ, organ=organ, places=asked.places, noise=asked.noise)
            tell(radius_m, pool.map(one, range(asked.draws)) if asked.processes > 1 else map(one, range(asked.draws)))


if __name__ == "__main__":
    main()
