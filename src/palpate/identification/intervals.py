"""Intervals of what presses determine: by profile likelihoods, and by the bootstrap over places.

A profile holds one unknown at a value and fits all others, so that its interval is as wide as what they can make up for
(Raue et al., Bioinformatics 25, 2009). Where the profile stays below the threshold up to the end of a range, the
interval is open there: the presses do not determine that end, the range does.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from palpate.identification.fit import MixedModel, Options, fitted, scaling_near
from palpate.identification.force_table import natural
from palpate.identification.progress import UNFOLLOWED, Progress

LEVEL = 0.9
"""Probability of all intervals."""
MOSTLY = 0.8
"""Share of a range that fits, at and above which a parameter is said to be unknown."""
GRID, REFINED = 9, 3
"""Values of a profile over a range, and searches for each crossing of the threshold."""
STEP, MOST_STEPS = 0.5, 14
"""Where a profile has no range: the first step over the expected half width, and most steps to a side."""


class Interval(NamedTuple):
    """The best value of a quantity with its interval.

    open_low, open_high : whether an end is that of the quantity's range, rather than determined by the presses
    share : of the range that the interval takes, 0 where there is no range
    """

    low: float
    best: float
    high: float
    open_low: bool = False
    open_high: bool = False
    share: float = 0.0

    @property
    def known(self) -> bool:
        """Whether the presses narrow the range."""
        return self.share < MOSTLY

    def through(self, of: Callable[[float], float]) -> "Interval":
        """Return the interval of an increasing function ``of`` the quantity."""
        return self._replace(low=float(of(self.low)), best=float(of(self.best)), high=float(of(self.high)))


class Profile(NamedTuple):
    """Profile likelihood: values (k,) that rise, minus2 (k,) of −2 log likelihood above the best, young_pa (k,)."""

    values: np.ndarray
    minus2: np.ndarray
    young_pa: np.ndarray


def threshold(level: float, places: int) -> float:
    """Return by how much −2 log likelihood rises at the ends of an interval: n log(1 + t²/(n − 1)) for n places.

    t is Student's quantile. This is exact for the mean of n normal values whose variance is fitted, too; for many
    places it is the quantile of χ² of one degree. The modulus is such a mean where places differ by more than noise.
    """
    n = max(places, 2)
    return float(n * np.log1p(student.ppf(0.5 + 0.5 * level, n - 1) ** 2 / (n - 1)))


Unknown = dict[str, float]
Rise = Callable[[float, Unknown], tuple[Unknown, float]]
"""A fit with one unknown held: from its value, and the unknowns to start from, to the best ones, and −2 log likelihood
above the least."""
Found = dict[float, tuple[Unknown, float]]
"""Fits with one unknown held, by its value: the other unknowns, and −2 log likelihood above the least."""


@dataclass(frozen=True, eq=False)
class Profiler:
    """Finds profiles of a model, from its unknowns of the greatest likelihood and the ``least`` −2 log likelihood."""

    model: MixedModel
    best: Unknown
    least: float

    @property
    def rise(self) -> float:
        """By how much −2 log likelihood rises at the ends of an interval."""
        return threshold(LEVEL, self.model.data.places)

    def parameter(self, name: str) -> tuple[Interval, Profile]:
        """Return the interval and profile of a forward model's parameter in its own unit."""
        parameter = next(p for p in self.model.table.free if p.name == name)
        return self._over_range(name, lambda place: natural(parameter, place))

    def offset_m(self) -> tuple[Interval, Profile]:
        """Return the interval and profile of the mean offset of first touch [m]."""
        return self._over_range("offset", self.model.offset_at)

    def young_pa(self) -> tuple[Interval, Profile]:
        """Return the interval and profile of E [Pa], with the forward model's own error in the interval.

        An error of force that all places have in common is one of the modulus, so that squares of half widths add; so
        is that of a sensor's slope. An error of single places is a part of how places differ.
        """
        scaling = scaling_near(self.model, self.best, young=True)
        log_e = float(np.log(self.model.values(self.best)["young_pa"]))
        return self._modulus(lambda value, start: self._above(*fitted(self.model, start, {}, value, scaling)), log_e)

    def modulus_pa(self) -> tuple[Interval, Profile]:
        """Return the interval and profile of the modulus that is fitted [Pa], E/(1 − ν²) where ν is free."""
        return self._modulus(self._holding("log_modulus"), self.best["log_modulus"])

    def excess(self) -> Interval:
        """Return the interval of the exponent of depth that the presses have above the forward model's."""
        interval, _ = self._stepped(self._holding("excess"), self.best["excess"], 0.05)
        return self._with_error(interval, self.model.table.forward.relative_error)

    def _modulus(self, rise: Rise, best_log: float) -> tuple[Interval, Profile]:
        half_width = float(max(0.01, 1.6 * self.best["place"] / np.sqrt(self.model.data.places)))
        interval, profile = self._stepped(rise, best_log, half_width)
        interval = self._with_error(interval, self.model.table.forward.common_error)
        return interval.through(np.exp), profile._replace(values=np.exp(profile.values))

    def _with_error(self, interval: Interval, error: float) -> Interval:
        """Widen an interval of a log by the relative ``error`` of the forward model, and that of the sensor's slope."""
        width = np.sqrt(self.rise) * float(np.hypot(error, self.model.data.records.force_error))
        below, above = np.hypot(interval.best - interval.low, width), np.hypot(interval.high - interval.best, width)
        return interval._replace(low=float(interval.best - below), high=float(interval.best + above))

    def _above(self, unknown: Unknown, value: float) -> tuple[Unknown, float]:
        return unknown, max(value - self.least, 0.0)

    def _holding(self, name: str) -> Rise:
        scaling = scaling_near(self.model, self.best, (name,))
        return lambda value, start: self._above(*fitted(self.model, start, {name: value}, None, scaling))

    def _over_range(self, name: str, in_unit: Callable[[float], float]) -> tuple[Interval, Profile]:
        """Return interval and profile of an unknown over its range; in_unit : from −1 … 1 of that to its own unit."""
        optimum, rise = self.best[name], self._holding(name)
        fits: Found = {optimum: (self.best, 0.0)}
        for grid in (np.linspace(-1, 1, GRID), np.linspace(1, -1, GRID)):
            start, side = self.best, np.sign(grid[-1])
            for value in grid[(grid - optimum) * side > 0]:
                fits[float(value)] = start, height = rise(float(value), start)
                if height > 3.0 * self.rise:
                    break
        for side in (-1.0, 1.0):
            self._refine(rise, fits, optimum, side)
        interval, profile = self._interval(fits, optimum, (-1.0, 1.0))
        values = np.array([in_unit(float(value)) for value in profile.values])
        return interval.through(in_unit), profile._replace(values=values)

    def _stepped(self, rise: Rise, optimum: float, half_width: float) -> tuple[Interval, Profile]:
        """Return interval and profile of an unknown without a range, by steps of about ``half_width`` to both sides."""
        fits: Found = {optimum: (self.best, 0.0)}
        for side in (-1.0, 1.0):
            start, value, step, last_height = self.best, optimum, STEP * half_width, 0.0
            for _ in range(MOST_STEPS):
                value += side * step
                fits[value] = start, height = rise(value, start)
                if height > self.rise:
                    break
                if height - last_height < 0.3 * self.rise:
                    step *= 1.7
                last_height = height
            self._refine(rise, fits, optimum, side)
        return self._interval(fits, optimum, (-np.inf, np.inf))

    def _refine(self, rise: Rise, fits: Found, optimum: float, side: float) -> None:
        """Add fits to ``fits`` near the crossing of the threshold on one side of ``optimum``, by the secant rule.

        The root of the height above the least −2 log likelihood is nearly a straight line there.
        """
        for _ in range(REFINED):
            values = sorted((v for v in fits if (v - optimum) * side >= 0), key=lambda v: abs(v - optimum))
            outside = [k for k, v in enumerate(values) if fits[v][1] > self.rise]
            if not outside:
                return
            outer, inner = values[outside[0]], values[outside[0] - 1]
            inner_root, wanted, outer_root = np.sqrt([fits[inner][1], self.rise, fits[outer][1]])
            part = np.clip((wanted - inner_root) / (outer_root - inner_root), 0.1, 0.9)
            gap = abs(outer - inner)
            if outer_root - inner_root < 0.1 or gap * min(part, 1 - part) < 5e-3 * abs(outer - optimum):
                return
            value = float(inner + part * (outer - inner))
            fits[value] = rise(value, fits[inner][0])

    def _interval(self, fits: Found, optimum: float, ends: tuple[float, float]) -> tuple[Interval, Profile]:
        """Return the interval around ``optimum`` where −2 log likelihood is below the threshold, and the whole profile.

        ends : of the unknown's range; where the threshold is not crossed, the interval is open at the outermost value
        """
        values = np.array(sorted(fits))
        minus2 = np.array([fits[v][1] for v in values])
        young = np.array([self.model.values(fits[v][0])["young_pa"] for v in values])
        roots, index = np.sqrt(minus2), int(np.flatnonzero(values == optimum)[0])
        limits, is_open = [], []
        for side in (-1, 1):
            inner = index  # number of the outermost value before −2 log likelihood exceeds the threshold
            while 0 <= inner + side < len(values) and minus2[inner + side] <= self.rise:
                inner += side
            is_open.append(not 0 <= inner + side < len(values))
            if is_open[-1]:
                limits.append(float(values[inner]))
            else:
                part = (np.sqrt(self.rise) - roots[inner]) / (roots[inner + side] - roots[inner])
                limits.append(float(values[inner] + part * (values[inner + side] - values[inner])))
        share = (limits[1] - limits[0]) / (ends[1] - ends[0])
        return Interval(limits[0], optimum, limits[1], is_open[0], is_open[1], share), Profile(values, minus2, young)


def bootstrap(
    model: MixedModel, best: Unknown, options: Options, progress: Progress = UNFOLLOWED
) -> dict[str, Interval]:
    """Return percentile intervals of moduli and free parameters over places drawn with replacement (Efron 1979).

    They are without the forward model's own error, which is the same for all places.
    """
    rng, places = np.random.default_rng(options.seed), model.data.places
    counts = [np.bincount(rng.integers(places, size=places), minlength=places) for _ in range(options.resamples)]
    scaling = scaling_near(model, best)

    def quantities(unknown: Unknown) -> dict[str, float]:
        values = model.values(unknown) | {"modulus_pa": float(np.exp(unknown["log_modulus"]))}
        return {name: values[name] for name in ("young_pa", "modulus_pa", *model.parameters)}

    def refit(drawn: np.ndarray) -> dict[str, float]:
        return quantities(fitted(replace(model, weights=drawn.astype(float)), best, scaling=scaling)[0])

    samples = progress.each("places drawn with replacement", refit, counts)
    quantile_levels = [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL]
    intervals = {}
    for name, best_value in quantities(best).items() if samples else ():
        low, high = np.quantile([sample[name] for sample in samples], quantile_levels)
        intervals[name] = Interval(float(low), best_value, float(high))
    return intervals
