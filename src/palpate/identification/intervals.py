"""What presses determine and what they leave open: profile likelihoods, and the bootstrap over places.

A profile holds one unknown at a value and fits all others, so that its interval is as wide as what they can make up for
(Raue et al., Bioinformatics 25, 2009). Where it stays below the threshold up to the end of a range the interval is open
there: the presses do not determine that end, the range does.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from palpate.identification.fit import MixedModel, Options, fitted, rounded
from palpate.identification.force_table import natural
from palpate.identification.progress import Follow, unfollowed

LEVEL = 0.9
"""Of all intervals."""
MOSTLY = 0.8
"""Share of a range that fits, at and above which a parameter is said to be unknown."""
GRID, REFINED = 9, 3
"""Values of a profile over a range, and searches for each crossing of the threshold."""
STEP, MOST_STEPS = 0.5, 14
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


class Profile(NamedTuple):
    """Profile likelihood: values (k,) that rise, minus2 (k,) of −2 log likelihood above the best, young_pa (k,)."""

    values: np.ndarray
    minus2: np.ndarray
    young_pa: np.ndarray


def threshold(level: float, places: int) -> float:
    """Return how far −2 log likelihood may rise in an interval: n log(1 + t²/(n − 1)) for n places.

    That is exact for the mean of n normal values whose variance is fitted too, and χ² of one degree for many. The
    modulus is such a mean where places differ more than noise.
    """
    n = max(places, 2)
    return float(n * np.log1p(student.ppf(0.5 + 0.5 * level, n - 1) ** 2 / (n - 1)))


Unknown = dict[str, float]
Rise = Callable[[float, Unknown], tuple[Unknown, float]]
"""From a value, and where to begin, to the unknown that fit best with it, and −2 log likelihood above the best."""


@dataclass(frozen=True, eq=False)
class Profiler:
    """Profiles of a fitted model: its best unknown, and −2 log likelihood there."""

    model: MixedModel
    best: Unknown
    least: float

    @property
    def rise(self) -> float:
        """The threshold."""
        return threshold(LEVEL, self.model.data.places)

    def parameter(self, name: str) -> tuple[Interval, Profile]:
        """Return the interval and profile of a forward model's parameter in its own unit."""
        parameter = next(p for p in self.model.table.free if p.name == name)
        return self._over_range(name, lambda place: natural(parameter, place))

    def offset_m(self) -> tuple[Interval, Profile]:
        """Return the interval and profile of the mean offset of first touch [m]."""
        return self._over_range("offset", self.model.offset_at)

    def young_pa(self) -> tuple[Interval, Profile]:
        """Return the interval and profile of E, with the forward model's own error in the interval.

        A force that is wrong by a share at all places makes the modulus wrong by it, so that the squares of half widths
        add; what is wrong at single places is part of how places differ. So with the error of a sensor's slope.
        """
        around = rounded(self.model, self.best, young=True)
        at = float(np.log(self.model.values(self.best)["young_pa"]))
        return self._modulus(lambda value, start: self._above(*fitted(self.model, start, {}, value, around)), at)

    def modulus_pa(self) -> tuple[Interval, Profile]:
        """Return the interval and profile of the modulus that is fitted, E/(1 − ν²) where ν is free."""
        return self._modulus(self._holding("log_modulus"), self.best["log_modulus"])

    def excess(self) -> Interval:
        """Return the interval of the exponent that the presses have above the forward model's."""
        interval, _ = self._stepped(self._holding("excess"), self.best["excess"], 0.05)
        return self._with_error(interval, self.model.table.forward.relative_error)

    def _modulus(self, rise: Rise, at: float) -> tuple[Interval, Profile]:
        half_width = float(max(0.01, 1.6 * self.best["place"] / np.sqrt(self.model.data.places)))
        interval, profile = self._stepped(rise, at, half_width)
        interval = self._with_error(interval, self.model.table.forward.common_error)
        return interval.through(np.exp), profile._replace(values=np.exp(profile.values))

    def _with_error(self, interval: Interval, error: float) -> Interval:
        """Return an interval that an ``error`` of the forward model widens, and that of the sensor's slope."""
        own = np.sqrt(self.rise) * float(np.hypot(error, self.model.data.records.force_error))
        low, high = np.hypot(interval.best - interval.low, own), np.hypot(interval.high - interval.best, own)
        return interval._replace(low=float(interval.best - low), high=float(interval.best + high))

    def _above(self, unknown: Unknown, value: float) -> tuple[Unknown, float]:
        return unknown, max(value - self.least, 0.0)

    def _holding(self, name: str) -> Rise:
        around = rounded(self.model, self.best, (name,))
        return lambda value, start: self._above(*fitted(self.model, start, {name: value}, None, around))

    def _over_range(self, name: str, own: Callable[[float], float]) -> tuple[Interval, Profile]:
        at, rise = self.best[name], self._holding(name)
        found = {at: (self.best, 0.0)}
        for grid in (np.linspace(-1, 1, GRID), np.linspace(1, -1, GRID)):
            start, side = self.best, np.sign(grid[-1])
            for value in grid[(grid - at) * side > 0]:
                found[float(value)] = start, above = rise(float(value), start)
                if above > 3.0 * self.rise:
                    break
        for side in (-1.0, 1.0):
            self._refine(rise, found, at, side)
        interval, profile = self._interval(found, at, (-1.0, 1.0))
        return interval.through(own), profile._replace(values=np.array([own(float(v)) for v in profile.values]))

    def _stepped(self, rise: Rise, at: float, first: float) -> tuple[Interval, Profile]:
        found = {at: (self.best, 0.0)}
        for side in (-1.0, 1.0):
            start, value, step, last = self.best, at, STEP * first, 0.0
            for _ in range(MOST_STEPS):
                value += side * step
                found[value] = start, now = rise(value, start)
                if now > self.rise:
                    break
                if now - last < 0.3 * self.rise:
                    step *= 1.7
                last = now
            self._refine(rise, found, at, side)
        return self._interval(found, at, (-np.inf, np.inf))

    def _refine(self, rise: Rise, found: dict[float, tuple[Unknown, float]], at: float, side: float) -> None:
        """Add values near the crossing of the threshold on one side; the root of the rise is nearly straight there."""
        for _ in range(REFINED):
            values = sorted((v for v in found if (v - at) * side >= 0), key=lambda v: abs(v - at))
            outside = [k for k, v in enumerate(values) if found[v][1] > self.rise]
            if not outside:
                return
            b, a = values[outside[0]], values[outside[0] - 1]
            inner, middle, outer = np.sqrt([found[a][1], self.rise, found[b][1]])
            share = np.clip((middle - inner) / (outer - inner), 0.1, 0.9)
            if outer - inner < 0.1 or abs(b - a) * min(share, 1 - share) < 5e-3 * abs(b - at):
                return
            value = float(a + share * (b - a))
            found[value] = rise(value, found[a][0])

    def _interval(
        self, found: dict[float, tuple[Unknown, float]], at: float, ends: tuple[float, float]
    ) -> tuple[Interval, Profile]:
        values = np.array(sorted(found))
        minus2 = np.array([found[v][1] for v in values])
        young = np.array([self.model.values(found[v][0])["young_pa"] for v in values])
        root, here = np.sqrt(minus2), int(np.flatnonzero(values == at)[0])
        limits, opens = [], []
        for step in (-1, 1):  # outward to the last value before the first that is too unlikely
            edge = here
            while 0 <= edge + step < len(values) and minus2[edge + step] <= self.rise:
                edge += step
            opens.append(not 0 <= edge + step < len(values))
            if opens[-1]:
                limits.append(float(values[edge]))
            else:
                share = (np.sqrt(self.rise) - root[edge]) / (root[edge + step] - root[edge])
                limits.append(float(values[edge] + share * (values[edge + step] - values[edge])))
        share = (limits[1] - limits[0]) / (ends[1] - ends[0])
        return Interval(limits[0], at, limits[1], opens[0], opens[1], share), Profile(values, minus2, young)


def bootstrap(
    model: MixedModel, best: Unknown, options: Options, spread_out: Callable[..., Iterable] = map,
    follow: Follow = unfollowed,
) -> dict[str, Interval]:  # fmt: skip
    """Return percentile intervals of young_pa and free parameters over places drawn with replacement (Efron 1979).

    Without the forward model's own error, which is the same for all places. spread_out : map, or that of a pool
    """
    rng, places = np.random.default_rng(options.seed), model.data.places
    drawn = [np.bincount(rng.integers(places, size=places), minlength=places) for _ in range(options.resamples)]

    around = rounded(model, best)

    def refit(counts: np.ndarray) -> dict[str, float]:
        return named(fitted(replace(model, weights=counts.astype(float)), best, around=around)[0])

    def named(unknown: Unknown) -> dict[str, float]:
        found = model.values(unknown) | {"modulus_pa": float(np.exp(unknown["log_modulus"]))}
        return {name: found[name] for name in ("young_pa", "modulus_pa", *model.parameters)}

    numbers = follow("places drawn with replacement", range(len(drawn)))
    samples = [sample for _, sample in zip(numbers, spread_out(refit, drawn), strict=True)]
    ends = [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL]
    found = {}
    for name, at in named(best).items() if samples else ():
        low, high = np.quantile([sample[name] for sample in samples], ends)
        found[name] = Interval(float(low), at, float(high))
    return found
