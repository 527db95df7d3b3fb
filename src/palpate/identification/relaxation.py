"""How the force of a press relaxes while its depth is held: the kernel of linear relaxation, and how well it is known.

The curve of force over depth is not assumed: the force of tissue that has no time to relax is a cubic spline of depth,
fitted through the hereditary integral, relaxation during the loading included. From the loading alone it predicts the
force while the depth is held. The kernel is fitted to all presses, the two parts weighted by the errors that they have.

Trap: what relaxes faster than the loading lasts is seen by its end only. G(t) is relative to the instantaneous modulus,
which is an extrapolation by the fastest branch; ratios of G from a tenth of a second on are measured.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import least_squares, minimize_scalar

from palpate.bodies.material import LARGEST_SUM, Series
from palpate.errors import InputError
from palpate.identification.hereditary import Branches, Fading, Kernel
from palpate.identification.presses import Press, PressRecords

HELD = 0.002
"""Share of the last depth by which depth may differ from it while it is held."""
LEAST_HELD_S, LEAST_HELD_POINTS, LEAST_LOADING_POINTS = 1.0, 10, 6
COEFFICIENTS = 7
"""Most coefficients of the spline of force over depth; a loading of few points has half as many as these."""
RIDGE = 1e-12


@dataclass(frozen=True, eq=False)
class Hold:
    """A press whose depth was held, its force as a share of the largest.

    curves : (k, m) functions of depth at the samples, the instantaneous force being a combination of them
    force : (k,); held : number of the first sample at the last depth
    """

    press: Press
    time_s: np.ndarray
    curves: np.ndarray
    force: np.ndarray
    held: int

    @property
    def held_s(self) -> np.ndarray:
        """Times of the samples after the first at the last depth, since that one [s]."""
        return self.time_s[self.held + 1 :] - self.time_s[self.held]

    @property
    def held_force(self) -> np.ndarray:
        """Force at these times, as a share of the largest."""
        return self.force[self.held + 1 :]

    @property
    def loading_s(self) -> float:
        """Time from a twentieth of the held depth to the hold [s]."""
        deep = self.press.depth_m > 0.05 * self.press.depth_m[-1]
        return float(self.time_s[self.held] - self.time_s[int(deep.argmax())])

    def fit(self, kernel: Kernel, weight: float = 0.0) -> np.ndarray:
        """Return the force (k,), as a share of the largest, that fits best.

        weight : of samples at the held depth; with none the force follows from the loading alone
        """
        basis = kernel.respond(self.time_s, self.curves)
        return basis @ self.coefficients(basis, weight)

    def coefficients(self, basis: np.ndarray, weight: float) -> np.ndarray:
        """Return the factors (m,) of the columns of ``basis`` (k, m) that fit best; see ``fit``."""
        begin = self.held + 1
        normal, right = basis[:begin].T @ basis[:begin], basis[:begin].T @ self.force[:begin]
        if weight > 0.0:
            normal += weight**2 * (basis[begin:].T @ basis[begin:])
            right += weight**2 * (basis[begin:].T @ self.force[begin:])
        normal.flat[:: len(normal) + 1] += RIDGE * normal.trace()  # where no sample sees a spline
        return np.linalg.solve(normal, right)

    def error(self, kernel: Kernel) -> np.ndarray:
        """Return what is predicted too much of the force while the depth is held, as a share of the largest force."""
        return self.fit(kernel)[self.held + 1 :] - self.held_force

    def left(self, kernel: Kernel, weight: float) -> np.ndarray:
        """Return what ``fit`` leaves (k,), samples at the held depth times ``weight``."""
        found = self.fit(kernel, weight) - self.force
        found[self.held + 1 :] *= weight
        return found


def hold_of(press: Press) -> Hold:
    """Return a press as a hold.

    Raises InputError if it has no times or is not held for LEAST_HELD_S at its last depth.
    """
    place = f"the press {press.name}"
    if press.time_s is None:
        raise InputError(f"{place} has no times; give time_s, or do not ask for its relaxation.")
    depth, peak = press.depth_m, float(press.force_n.max())
    moving = np.flatnonzero(np.abs(depth - depth[-1]) > HELD * abs(depth[-1]))
    held = int(moving[-1]) + 1 if len(moving) else 0
    lasts = float(press.time_s[-1] - press.time_s[held])
    if held < LEAST_LOADING_POINTS or len(depth) - held <= LEAST_HELD_POINTS or lasts < LEAST_HELD_S:
        raise InputError(
            f"{place} is at its last depth, {depth[-1]:.3g} m, for {lasts:.2g} s after {held} samples of loading; "
            f"relaxation needs {LEAST_HELD_S:g} s and {LEAST_HELD_POINTS} samples at a depth that is held, and "
            f"{LEAST_LOADING_POINTS} before."
        )
    if not peak > 0.0:
        raise InputError(f"{place} has no positive force; leave it out.")
    # cubic B-splines on even knots from depth 0 to the largest
    count, most = max(4, min(COEFFICIENTS, held // 2)), float(depth.max())
    knots = np.concatenate([np.zeros(3), np.linspace(0.0, most, count - 2), np.full(3, most)])
    curves = BSpline.design_matrix(np.clip(depth, 0.0, most), knots, 3).toarray()
    return Hold(press, press.time_s, curves, press.force_n / peak, held)


def holds_of(records: PressRecords) -> tuple[list[Hold], list[str]]:
    """Return the presses that were held, and why the others are none."""
    found, refused = [], []
    for press in records.presses:
        try:
            found.append(hold_of(press))
        except InputError as error:
            refused.append(str(error))
    return found, refused


def relaxed(hold: Hold, kernel: Branches) -> Press:
    """Return the loading of a press with the forces that tissue with time to relax has at the same depths.

    They are the measured ones times what the branches make of the smooth curve, so that errors stay as they are.
    """
    basis = kernel.respond(hold.time_s, hold.curves)
    curve = hold.coefficients(basis, 1.0)
    loading = slice(0, hold.held + 1)
    fast, instant = (basis @ curve)[loading], (hold.curves @ curve)[loading]
    left = 1.0 - sum(kernel.series.shares)
    share = np.clip(left * instant / np.where(fast > 0.0, fast, np.inf), left, 1.0)
    press = hold.press
    return replace(
        press, time_s=hold.time_s[loading], depth_m=press.depth_m[loading], force_n=share * press.force_n[loading]
    )


def without_time(records: PressRecords, kernel: Branches) -> PressRecords:
    """Return the presses with the forces that they have after a long time; those that were not held are left out."""
    return replace(records, presses=tuple(relaxed(hold, kernel) for hold in holds_of(records)[0]))


LEAST_WEIGHT = 0.02
SHORTEST, LONGEST = 0.3, 10.0
"""Times of branches: at least this part of the median step between samples, at most so many times the longest hold."""
EVALUATIONS, TOLERANCE = 40, 1e-5
"""Most evaluations of residuals in a fit, and the change at which it ends."""


def weight_of(kernel: Kernel, holds: Sequence[Hold]) -> float:
    """Return the scatter of the loading over that at the held depth, 1 at most, about the fits to each and to all.

    Forces at the held depth differ from those of one kernel by more than noise where tissue differs.
    """
    loading = [hold.left(kernel, 0.0)[: hold.held + 1] for hold in holds]
    free = sum(max(len(part) - hold.curves.shape[1], 1) for part, hold in zip(loading, holds, strict=True))
    held = np.concatenate([hold.left(kernel, 1.0)[hold.held + 1 :] for hold in holds])
    scatter = np.sqrt(sum(float(part @ part) for part in loading) / free)
    return float(np.clip(scatter / max(np.sqrt(np.mean(held**2)), 1e-12), LEAST_WEIGHT, 1.0))


def fit_branches(
    holds: Sequence[Hold], count: int, begin: Series | None = None, weight: float | None = None
) -> Branches:
    """Fit ``count`` branches to all presses by weighted least squares from ``begin``; ``weight`` : None for weight_of.

    Shares are positive and their sum below LARGEST_SUM. Branches are in the order of their times.
    """
    if weight is None:
        first = fit_branches(holds, count, begin, 1.0)
        return fit_branches(holds, count, first.series, weight_of(first, holds))
    step, span = _scales(holds)
    if begin is None:
        times = np.geomspace(3.0 * step, span, count) if count > 1 else np.array([np.sqrt(step * span)])
        begin = Series([0.8 / count] * count, times.tolist())
    shares, times = np.array(begin.shares, dtype=float), np.array(begin.times_s, dtype=float)
    low, high = np.log(SHORTEST * step), np.log(LONGEST * span)
    start = np.append(np.log(shares / (LARGEST_SUM - shares.sum())), np.log(times))
    bounds = np.repeat([-9.0, low], count), np.repeat([9.0, high], count)
    return _branches(_least(_branches, np.clip(start, bounds[0] + 1e-3, bounds[1] - 1e-3), bounds, holds, weight))


def _branches(unknowns: np.ndarray) -> Branches:
    weights, times = np.split(np.exp(unknowns), 2)
    shares, order = LARGEST_SUM * weights / (1.0 + weights.sum()), np.argsort(times)
    return Branches(Series(shares[order].tolist(), times[order].tolist()))


def fit_fading(holds: Sequence[Hold], weight: float) -> Fading:
    """Fit a power of time to all presses, by least squares as ``fit_branches``."""
    step, span = _scales(holds)
    bounds = np.array([0.01, np.log(1e-2 * step)]), np.array([0.99, np.log(span)])

    def fading(unknowns: np.ndarray) -> Fading:
        return Fading(float(unknowns[0]), float(np.exp(unknowns[1])))

    return fading(_least(fading, np.array([0.2, np.log(step)]), bounds, holds, weight))


def _least(
    kernel_of: Callable[[np.ndarray], Kernel], start: np.ndarray, bounds: tuple, holds: Sequence[Hold], weight: float
) -> np.ndarray:
    """Return the unknowns (n,) of the kernel that leaves least, looked for from ``start`` (n,) within bounds."""

    def away(unknowns: np.ndarray) -> np.ndarray:
        return np.concatenate([hold.left(kernel_of(unknowns), weight) for hold in holds])

    return least_squares(away, start, bounds=bounds, max_nfev=EVALUATIONS, xtol=TOLERANCE, ftol=TOLERANCE).x


def _scales(holds: Sequence[Hold]) -> tuple[float, float]:
    """Return the median step between samples, and the longest hold [s]."""
    steps = np.concatenate([np.diff(hold.time_s) for hold in holds])
    return float(np.median(steps)), max(float(hold.held_s[-1]) for hold in holds)


class Noise(NamedTuple):
    """Errors of a fit as an autoregressive process of first order in continuous time.

    scatter : standard deviation, as a share of the largest force; memory_s : time after which errors forget [s]
    minus2 : −2 log-likelihood
    """

    scatter: float
    memory_s: float
    minus2: float


def noise_of(error: np.ndarray, time_s: np.ndarray) -> Noise:
    """Fit the process to errors (k,) at ``time_s`` (k,) [s], by maximum likelihood."""
    steps = np.diff(time_s)

    def scaled(log_memory: float) -> tuple[float, float]:
        kept = np.exp(-steps / np.exp(log_memory))
        new = np.append(error[0], (error[1:] - kept * error[:-1]) / np.sqrt(1.0 - kept**2))
        variance = max(float(np.mean(new**2)), 1e-30)
        return len(error) * (np.log(2.0 * np.pi * variance) + 1.0) + float(np.log1p(-(kept**2)).sum()), variance

    bounds = np.log([0.1 * steps.min(), 10.0 * (time_s[-1] - time_s[0])])
    best = minimize_scalar(lambda log_memory: scaled(log_memory)[0], bounds=bounds, method="bounded").x
    minus2, variance = scaled(best)
    return Noise(float(np.sqrt(variance)), float(np.exp(best)), minus2)


def information(hold: Hold, kernel: Branches) -> float:
    """Return Bayes' information criterion of one press (Schwarz 1978), with errors that are correlated in time."""
    unknowns = 2 * len(kernel.series.shares) + 2
    noise = noise_of(hold.left(kernel, 1.0)[hold.held + 1 :], hold.held_s)
    return noise.minus2 + unknowns * float(np.log(len(hold.held_s)))


MOST_BRANCHES = 3
"""Most branches that are tried for a press of one's own."""


class Relaxation(NamedTuple):
    """Branches of the force that held presses need, and the time that their loading took [s]."""

    kernel: Branches
    loading_s: float
    holds: int

    @property
    def faster(self) -> float:
        """The modulus at the time that loading takes after a sudden press, over that after relaxation."""
        return float(self.kernel.series.modulus(self.loading_s))


def relaxation_of(records: PressRecords) -> Relaxation | None:
    """Return the number of branches that Bayes' information criterion asks of held presses; None if none is held."""
    holds, _ = holds_of(records)
    if not holds:
        return None
    kernels = [fit_branches(holds, count) for count in range(1, MOST_BRANCHES + 1)]
    best = min(kernels, key=lambda kernel: float(np.mean([information(hold, kernel) for hold in holds])))
    return Relaxation(best, float(np.median([hold.loading_s for hold in holds])), len(holds))


LEAST_GROUPS = 8
"""Specimens, or presses, from which on they are drawn anew; for fewer, errors are, with their correlation in time."""


class Draws(NamedTuple):
    """Branches that were fitted to data drawn anew, and what was drawn: "specimens", "presses" or "errors"."""

    kernels: tuple[Branches, ...]
    drawn: str

    def interval(self, of: Callable[[Branches], np.ndarray]) -> np.ndarray:
        """Return the 5th and 95th percentile (2, …) of a number of the branches."""
        return np.quantile([of(kernel) for kernel in self.kernels], [0.05, 0.95], axis=0)


def draw_branches(holds: Sequence[Hold], kernel: Branches, draws: int, rng: np.random.Generator) -> Draws:
    """Fit as many branches as ``kernel`` has to data that are drawn anew, ``draws`` times (Efron 1979).

    Whole specimens are drawn, with all their presses; where there are fewer than LEAST_GROUPS of them, presses; where
    there are fewer of these, errors of each.
    """
    count, weight = len(kernel.series.shares), weight_of(kernel, holds)
    groups: dict[str, list[Hold]] = {}
    for hold in holds:
        groups.setdefault(hold.press.specimen or hold.press.name, []).append(hold)
    kinds = {"specimens": list(groups.values()), "presses": [[hold] for hold in holds]}
    for drawn, parts in kinds.items():
        if len(parts) >= LEAST_GROUPS:
            picks = (rng.integers(len(parts), size=len(parts)) for _ in range(draws))
            chosen = ([one for i in pick for one in parts[i]] for pick in picks)
            return Draws(tuple(fit_branches(each, count, kernel.series, weight) for each in chosen), drawn)
    redrawn = [_redrawer(hold, kernel) for hold in holds]
    again = ([draw(rng) for draw in redrawn] for _ in range(draws))
    return Draws(tuple(fit_branches(each, count, kernel.series, weight) for each in again), "errors")


def _redrawer(hold: Hold, kernel: Branches) -> Callable[[np.random.Generator], Hold]:
    """Return what draws a press anew: its best fit, and errors of the process that its own have."""
    best = hold.fit(kernel, 1.0)
    noise = noise_of(hold.force - best, hold.time_s)
    kept = np.exp(-np.diff(hold.time_s) / noise.memory_s)

    def draw(rng: np.random.Generator) -> Hold:
        fresh = noise.scatter * rng.normal(size=len(best))
        fresh[1:] *= np.sqrt(1.0 - kept**2)
        for k in range(1, len(fresh)):
            fresh[k] += kept[k - 1] * fresh[k - 1]
        return replace(hold, force=best + fresh)

    return draw
