"""What presses determine and what they leave open: profile likelihoods, and the bootstrap over places.

A profile holds one unknown at a value and fits all others, so that its interval is as wide as what they can make up for
(Raue et al., Bioinformatics 25, 2009). Where it stays below the threshold up to the end of a range the interval is open
there: the presses do not determine that end, the range does.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from palpate.identification.fit import MixedModel, Options, fitted
from palpate.identification.force_table import natural

MOSTLY = 0.8
"""Share of a range that fits, at and above which a parameter is said to be unknown."""
GRID, REFINED = 9, 3
"""Values of a profile over a range, and searches for each crossing of the threshold."""
STEP, STEPS = 0.5, 14
"""Of a profile that has no range: the first step as a share of the half width expected, and most steps to a side."""


class Interval(NamedTuple):
    """A value with its interval; open_low, open_high : its end is that of a range, and not for the presses.

    share : of the range that the interval holds, 0 where there is no range
    """

    low: float
    best: float
    high: float
    open_low: bool = False
    open_high: bool = False
    share: float = 0.0

    @property
    def known(self) -> bool:
        """Whether the presses say more than the range did."""
        return self.share < MOSTLY

    def through(self, of: Callable[[float], float]) -> "Interval":
        """Return the interval of an increasing function of the value."""
        return self._replace(low=float(of(self.low)), best=float(of(self.best)), high=float(of(self.high)))


@dataclass(frozen=True, eq=False)
class Profile:
    """Profile likelihood: values (k,) that rise, and minus2 (k,) of −2 log likelihood above the best."""

    values: np.ndarray
    minus2: np.ndarray


def threshold(level: float, places: int) -> float:
    """Return how far −2 log likelihood may rise in an interval: n log(1 + t²/(n − 1)) for n places.

    That is exact for the mean of n normal values whose variance is fitted too, and χ² of one degree for many. The
    modulus is such a mean where places differ more than noise.
    """
    n = max(places, 2)
    return float(n * np.log1p(student.ppf(0.5 + 0.5 * level, n - 1) ** 2 / (n - 1)))


@dataclass(frozen=True, eq=False)
class Profiler:
    """Profiles of a fitted model: its best unknown, −2 log likelihood there, and the threshold."""

    model: MixedModel
    best: dict[str, float]
    least: float
    rise: float

    def over_range(self, name: str) -> tuple[Interval, Profile]:
        """Return the interval of an unknown in −1 … 1 of its range."""
        at = self.best[name]
        found = {at: 0.0}
        for grid in (np.linspace(-1, 1, GRID), np.linspace(1, -1, GRID)):
            start, side = self.best, np.sign(grid[-1])
            for value in grid[(grid - at) * side > 0]:
                start, rise = self._rise({name: float(value)}, start)
                found[float(value)] = rise
                if rise > 3.0 * self.rise:
                    break
        for side in (-1.0, 1.0):
            self._refine(lambda value: self._rise({name: value}, self.best)[1], found, at, side)
        return self._interval(found, at, (-1.0, 1.0))

    def young(self, of_modulus: bool) -> tuple[Interval, Profile]:
        """Return the interval of log E, or of the log of the modulus that is fitted, with the model's own error.

        A force that is wrong by a share makes the modulus wrong by it, so that the squares of half widths add.
        """
        values = self.model.values(self.best)
        at = self.best["log_modulus"] if of_modulus else float(np.log(values["young_pa"]))

        def rise(value: float, start: dict[str, float]) -> tuple[dict[str, float], float]:
            return self._rise({"log_modulus": value}, start) if of_modulus else self._rise({}, start, value)

        found = {at: 0.0}
        for side in (-1.0, 1.0):
            start, value, step, last = self.best, at, self._half_width() * STEP, 0.0
            for _ in range(STEPS):
                value += side * step
                start, now = rise(value, start)
                found[value] = now
                if now > self.rise:
                    break
                if now - last < 0.3 * self.rise:
                    step *= 1.7
                last = now
            self._refine(lambda value: rise(value, self.best)[1], found, at, side)
        interval, profile = self._interval(found, at, (-np.inf, np.inf))
        own = np.sqrt(self.rise) * self.model.table.forward.relative_error
        low, high = np.hypot(at - interval.low, own), np.hypot(interval.high - at, own)
        return interval._replace(low=at - low, high=at + high), profile

    def _half_width(self) -> float:
        places = len(self.model.data.layout.place_start) - 1
        return float(max(0.01, 1.6 * max(self.best["place"], 0.02) / np.sqrt(places)))

    def _rise(
        self, held: dict[str, float], start: dict[str, float], young: float | None = None
    ) -> tuple[dict[str, float], float]:
        unknown, value = fitted(self.model, start, held, young)
        return unknown, max(value - self.least, 0.0)

    def _refine(self, rise: Callable[[float], float], found: dict[float, float], at: float, side: float) -> None:
        """Add values near the crossing of the threshold on one side, by the root of the rise, which is nearly straight."""
        for _ in range(REFINED):
            values = sorted((v for v in found if (v - at) * side >= 0), key=lambda v: abs(v - at))
            outside = [k for k, v in enumerate(values) if found[v] > self.rise]
            if not outside:
                return
            b, a = values[outside[0]], values[outside[0] - 1]
            roots = np.sqrt([found[a], self.rise, found[b]])
            if roots[2] - roots[0] < 0.1:
                return
            share = np.clip((roots[1] - roots[0]) / (roots[2] - roots[0]), 0.1, 0.9)
            if abs(b - a) * min(share, 1 - share) < 5e-3 * max(abs(b - at), 1e-3):
                return
            value = float(a + share * (b - a))
            found[value] = rise(value)

    def _interval(
        self, found: dict[float, float], at: float, ends: tuple[float, float]
    ) -> tuple[Interval, Profile]:
        values = np.array(sorted(found))
        minus2 = np.array([found[v] for v in values])
        root = np.sqrt(minus2)
        inside = np.flatnonzero(minus2 <= self.rise)
        limit = []
        for edge, step in ((inside[0], -1), (inside[-1], 1)):
            if 0 <= edge + step < len(values):
                share = (np.sqrt(self.rise) - root[edge]) / (root[edge + step] - root[edge])
                limit.append(values[edge] + share * (values[edge + step] - values[edge]))
            else:
                limit.append(values[edge])
        opens = [bool(minus2[0] <= self.rise), bool(minus2[-1] <= self.rise)]
        width = (limit[1] - limit[0]) / (ends[1] - ends[0])
        return Interval(float(limit[0]), at, float(limit[1]), *opens, float(width)), Profile(values, minus2)


def parameter_interval(profiler: Profiler, name: str) -> tuple[Interval, Profile]:
    """Return the interval of a forward model's parameter in its own unit."""
    parameter = next(p for p in profiler.model.table.free if p.name == name)
    interval, profile = profiler.over_range(name)
    own = np.array([natural(parameter, float(value)) for value in profile.values])
    return interval.through(lambda value: natural(parameter, value)), Profile(own, profile.minus2)


def bootstrap(model: MixedModel, best: dict[str, float], options: Options) -> dict[str, np.ndarray]:
    """Return young_pa and the free parameters (resamples,) of fits to places drawn with replacement (Efron 1979)."""
    rng = np.random.default_rng(options.seed)
    places = len(model.data.layout.place_start) - 1
    found: dict[str, list[float]] = {name: [] for name in ["young_pa", "modulus_pa", *model.parameters]}
    for _ in range(options.resamples):
        drawn = replace(model, weights=np.bincount(rng.integers(places, size=places), minlength=places).astype(float))
        unknown, _ = fitted(drawn, best)
        values = model.values(unknown) | {"modulus_pa": float(np.exp(unknown["log_modulus"]))}
        for name, kept in found.items():
            kept.append(values[name])
    return {name: np.array(values) for name, values in found.items()}


def bootstrap_interval(best: float, drawn: np.ndarray, level: float) -> Interval:
    """Return the percentile interval of values (resamples,) that the bootstrap drew."""
    low, high = np.quantile(drawn, [0.5 - 0.5 * level, 0.5 + 0.5 * level])
    return Interval(float(low), best, float(high))
