"""Fit the relaxation function of tissue to presses whose depth was held, with intervals of it.

The force over depth of tissue without time to relax, the instantaneous force, is not assumed: it is a cubic spline of
depth, fitted through the hereditary integral, so that relaxation during the loading is included. A spline fitted to the
loading alone predicts the force while the depth is held. The relaxation function is fitted to all presses, loading and
hold weighted by the errors that they have.

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
    """A press of k samples whose last depth was held.

    curves : (k, m) values of m splines of depth at the samples, whose combination is the instantaneous force
    force : (k,) over the largest; held : number of the first sample at the last depth
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
        """Return the force (k,) over the largest that fits best, by weighted least squares.

        weight : of samples at the held depth; with 0 the force follows from the loading alone
        """
        basis = kernel.respond(self.time_s, self.curves)
        return basis @ self.coefficients(basis, weight)

    def coefficients(self, basis: np.ndarray, weight: float) -> np.ndarray:
        """Return the factors (m,) with which the columns of ``basis`` (k, m) fit the force best.

        basis : force over time for each spline of depth; weight : as in ``fit``
        """
        first_held = self.held + 1
        normal, right_side = basis[:first_held].T @ basis[:first_held], basis[:first_held].T @ self.force[:first_held]
        if weight > 0.0:
            normal += weight**2 * (basis[first_held:].T @ basis[first_held:])
            right_side += weight**2 * (basis[first_held:].T @ self.force[first_held:])
        normal.flat[:: len(normal) + 1] += RIDGE * normal.trace()  # where no sample sees a spline
        return np.linalg.solve(normal, right_side)

    def error(self, kernel: Kernel) -> np.ndarray:
        """Return predicted less measured force while the depth is held, over the largest force."""
        return self.fit(kernel)[self.held + 1 :] - self.held_force

    def residuals(self, kernel: Kernel, weight: float) -> np.ndarray:
        """Return the residuals of ``fit`` (k,), over the largest force, those at the held depth times ``weight``."""
        residuals = self.fit(kernel, weight) - self.force
        residuals[self.held + 1 :] *= weight
        return residuals


def hold_of(press: Press) -> Hold:
    """Return a press as a hold, with splines of its depth.

    Raises InputError if it has no times, or is not held for LEAST_HELD_S at its last depth.
    """
    label = f"the press {press.name}"
    if press.time_s is None:
        raise InputError(f"{label} has no times; give time_s, or do not ask for its relaxation.")
    depth, peak = press.depth_m, float(press.force_n.max())
    moving = np.flatnonzero(np.abs(depth - depth[-1]) > HELD * abs(depth[-1]))
    held = int(moving[-1]) + 1 if len(moving) else 0
    held_s = float(press.time_s[-1] - press.time_s[held])
    if held < LEAST_LOADING_POINTS or len(depth) - held <= LEAST_HELD_POINTS or held_s < LEAST_HELD_S:
        raise InputError(
            f"{label} is at its last depth, {depth[-1]:.3g} m, for {held_s:.2g} s after {held} samples of loading; "
            f"relaxation needs {LEAST_HELD_S:g} s and {LEAST_HELD_POINTS} samples at a depth that is held, and "
            f"{LEAST_LOADING_POINTS} before."
        )
    if not peak > 0.0:
        raise InputError(f"{label} has no positive force; leave it out.")
    # cubic B-splines on even knots from depth 0 to the largest
    count, deepest_m = max(4, min(COEFFICIENTS, held // 2)), float(depth.max())
    knots = np.concatenate([np.zeros(3), np.linspace(0.0, deepest_m, count - 2), np.full(3, deepest_m)])
    curves = BSpline.design_matrix(np.clip(depth, 0.0, deepest_m), knots, 3).toarray()
    return Hold(press, press.time_s, curves, press.force_n / peak, held)


def holds_of(records: PressRecords) -> tuple[list[Hold], list[str]]:
    """Return the presses that were held, and a sentence for each other one that says why it cannot be used."""
    holds, refused = [], []
    for press in records.presses:
        try:
            holds.append(hold_of(press))
        except InputError as error:
            refused.append(str(error))
    return holds, refused


def relaxed(hold: Hold, kernel: Branches) -> Press:
    """Return the loading of a press with the forces of tissue that has time to relax at each depth.

    Measured forces are scaled by the fit's relaxed force over its force in the loading, so that they keep their errors.
    """
    basis = kernel.respond(hold.time_s, hold.curves)
    spline_factors = hold.coefficients(basis, 1.0)
    loading = slice(0, hold.held + 1)
    relaxing, instantaneous = (basis @ spline_factors)[loading], (hold.curves @ spline_factors)[loading]
    relaxed_share = 1.0 - sum(kernel.series.shares)
    ratio = np.clip(relaxed_share * instantaneous / np.where(relaxing > 0.0, relaxing, np.inf), relaxed_share, 1.0)
    press = hold.press
    return replace(
        press, time_s=hold.time_s[loading], depth_m=press.depth_m[loading], force_n=ratio * press.force_n[loading]
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
    """Return the weight of samples at the held depth: scatter of the loading over that of the hold, 1 at most.

    It is below 1 where tissue differs, as forces at the held depth then differ from one kernel's by more than noise.
    """
    loading = [hold.residuals(kernel, 0.0)[: hold.held + 1] for hold in holds]
    held = np.concatenate([hold.residuals(kernel, 1.0)[hold.held + 1 :] for hold in holds])
    degrees = sum(max(len(part) - hold.curves.shape[1], 1) for part, hold in zip(loading, holds, strict=True))
    scatter = np.sqrt(sum(float(part @ part) for part in loading) / degrees)
    return float(np.clip(scatter / max(np.sqrt(np.mean(held**2)), 1e-12), LEAST_WEIGHT, 1.0))


def fit_branches(
    holds: Sequence[Hold], count: int, start: Series | None = None, weight: float | None = None
) -> Branches:
    """Fit ``count`` branches to all presses by weighted least squares, in the order of their times.

    start : branches to start the search from; weight : of the samples at the held depth, None for ``weight_of``
    Unknowns are logs of times, and of shares over what all leave of LARGEST_SUM: shares are positive, their sum less.
    """
    if weight is None:
        unweighted = fit_branches(holds, count, start, 1.0)
        return fit_branches(holds, count, unweighted.series, weight_of(unweighted, holds))
    step, span = _time_scales(holds)
    if start is None:
        times = np.geomspace(3.0 * step, span, count) if count > 1 else np.array([np.sqrt(step * span)])
        start = Series([0.8 / count] * count, times.tolist())
    shares, times = np.array(start.shares, dtype=float), np.array(start.times_s, dtype=float)
    log_shortest, log_longest = np.log(SHORTEST * step), np.log(LONGEST * span)
    unknowns = np.append(np.log(shares / (LARGEST_SUM - shares.sum())), np.log(times))
    bounds = np.repeat([-9.0, log_shortest], count), np.repeat([9.0, log_longest], count)
    start_inside = np.clip(unknowns, bounds[0] + 1e-3, bounds[1] - 1e-3)
    return _branches(_least_squares(_branches, start_inside, bounds, holds, weight))


def _branches(unknowns: np.ndarray) -> Branches:
    weights, times = np.split(np.exp(unknowns), 2)
    shares, order = LARGEST_SUM * weights / (1.0 + weights.sum()), np.argsort(times)
    return Branches(Series(shares[order].tolist(), times[order].tolist()))


def fit_fading(holds: Sequence[Hold], weight: float) -> Fading:
    """Fit a power of time to all presses by least squares; weight : of the samples at the held depth."""
    step, span = _time_scales(holds)
    bounds = np.array([0.01, np.log(1e-2 * step)]), np.array([0.99, np.log(span)])

    def fading(unknowns: np.ndarray) -> Fading:
        return Fading(float(unknowns[0]), float(np.exp(unknowns[1])))

    return fading(_least_squares(fading, np.array([0.2, np.log(step)]), bounds, holds, weight))


def _least_squares(
    kernel_of: Callable[[np.ndarray], Kernel], start: np.ndarray, bounds: tuple, holds: Sequence[Hold], weight: float
) -> np.ndarray:
    """Return the unknowns (n,) of the kernel with the least residuals, from ``start`` (n,) within ``bounds``."""

    def residuals(unknowns: np.ndarray) -> np.ndarray:
        return np.concatenate([hold.residuals(kernel_of(unknowns), weight) for hold in holds])

    return least_squares(residuals, start, bounds=bounds, max_nfev=EVALUATIONS, xtol=TOLERANCE, ftol=TOLERANCE).x


def _time_scales(holds: Sequence[Hold]) -> tuple[float, float]:
    """Return the median step between samples, and the longest hold [s]."""
    steps = np.concatenate([np.diff(hold.time_s) for hold in holds])
    return float(np.median(steps)), max(float(hold.held_s[-1]) for hold in holds)


class Noise(NamedTuple):
    """Errors of a fit as an autoregressive process of first order in continuous time.

    scatter : standard deviation, over the largest force; memory_s : correlation time [s]; minus2 : −2 log likelihood
    """

    scatter: float
    memory_s: float
    minus2: float


def noise_of(error: np.ndarray, time_s: np.ndarray) -> Noise:
    """Fit an autoregressive process of first order to errors (k,) at ``time_s`` (k,) [s], by maximum likelihood."""
    steps = np.diff(time_s)

    def likelihood(log_memory: float) -> tuple[float, float]:
        """Return −2 log likelihood, and the variance with which it is greatest."""
        correlation = np.exp(-steps / np.exp(log_memory))
        innovations = (error[1:] - correlation * error[:-1]) / np.sqrt(1.0 - correlation**2)
        variance = max(float(np.mean(np.append(error[0], innovations) ** 2)), 1e-30)
        log_variances = float(np.log1p(-(correlation**2)).sum())
        return len(error) * (np.log(2.0 * np.pi * variance) + 1.0) + log_variances, variance

    bounds = np.log([0.1 * steps.min(), 10.0 * (time_s[-1] - time_s[0])])
    best_log = minimize_scalar(lambda log_memory: likelihood(log_memory)[0], bounds=bounds, method="bounded").x
    minus2, variance = likelihood(best_log)
    return Noise(float(np.sqrt(variance)), float(np.exp(best_log)), minus2)


def information(hold: Hold, kernel: Branches) -> float:
    """Return Bayes' information criterion of one press (Schwarz 1978), with errors that are correlated in time."""
    unknowns = 2 * len(kernel.series.shares) + 2
    noise = noise_of(hold.residuals(kernel, 1.0)[hold.held + 1 :], hold.held_s)
    return noise.minus2 + unknowns * float(np.log(len(hold.held_s)))


MOST_BRANCHES = 3
"""Most branches that are tried for a press of one's own."""


class Relaxation(NamedTuple):
    """Branches by which the force of held presses relaxes, the median time of loading [s], and how many were held."""

    kernel: Branches
    loading_s: float
    holds: int

    @property
    def faster(self) -> float:
        """The modulus at the time that loading takes after a sudden press, over that after relaxation."""
        return float(self.kernel.series.modulus(self.loading_s))


def relaxation_of(records: PressRecords) -> Relaxation | None:
    """Fit as many branches to held presses as Bayes' information criterion asks for; None if no press is held."""
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
    """Fit as many branches as ``kernel`` has to resampled data, ``draws`` times: the bootstrap (Efron 1979).

    Whole specimens are drawn with all their presses, or presses where there are fewer than LEAST_GROUPS specimens.
    Where there are fewer presses, too, errors about the fit to each press are drawn.
    """
    branch_count, weight = len(kernel.series.shares), weight_of(kernel, holds)
    groups: dict[str, list[Hold]] = {}
    for hold in holds:
        groups.setdefault(hold.press.specimen or hold.press.name, []).append(hold)
    kinds = {"specimens": list(groups.values()), "presses": [[hold] for hold in holds]}
    for drawn, candidates in kinds.items():
        if len(candidates) >= LEAST_GROUPS:
            picks = (rng.integers(len(candidates), size=len(candidates)) for _ in range(draws))
            drawn_holds = ([member for i in pick for member in candidates[i]] for pick in picks)
            return Draws(tuple(fit_branches(each, branch_count, kernel.series, weight) for each in drawn_holds), drawn)
    simulators = [_simulator(hold, kernel) for hold in holds]
    simulated = ([simulate(rng) for simulate in simulators] for _ in range(draws))
    return Draws(tuple(fit_branches(each, branch_count, kernel.series, weight) for each in simulated), "errors")


def _simulator(hold: Hold, kernel: Branches) -> Callable[[np.random.Generator], Hold]:
    """Return a function that simulates a press: its best fit plus random errors as correlated as its residuals."""
    best_fit_force = hold.fit(kernel, 1.0)
    noise = noise_of(hold.force - best_fit_force, hold.time_s)
    correlation = np.exp(-np.diff(hold.time_s) / noise.memory_s)

    def simulate(rng: np.random.Generator) -> Hold:
        errors = noise.scatter * rng.normal(size=len(best_fit_force))
        errors[1:] *= np.sqrt(1.0 - correlation**2)
        for k in range(1, len(errors)):
            errors[k] += correlation[k - 1] * errors[k - 1]
        return replace(hold, force=best_fit_force + errors)

    return simulate
