"""Force over time of linear relaxation: F(t) = ∫ G(t − s) dF₀(s), F₀ being the force of tissue without time to relax.

F₀ is a function of depth alone and any; that G does not depend on depth is Fung's quasi-linear viscoelasticity (1993,
section 7.6). Between samples F₀ changes evenly, for which the integrals are exact. The sphere that is pressed in
evenly is Lee and Radok's (1960).
"""

from dataclasses import dataclass

import numba
import numpy as np
from scipy.linalg import toeplitz
from scipy.optimize import least_squares

from palpate.bodies.material import Material, Series

EVEN = 1e-9
"""Relative differences of steps that are rounding."""


@dataclass(frozen=True, eq=False)
class Branches:
    """G(t) = 1 − Σ gᵢ (1 − exp(−t/τᵢ)): that of ``palpate.effects.prony``, over its instantaneous modulus."""

    series: Series

    def modulus(self, t: np.ndarray) -> np.ndarray:
        """Return G over that at the beginning, at times ``t`` (…) [s]."""
        return (1.0 - sum(self.series.shares)) * self.series.modulus(t)

    def respond(self, time_s: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """Return F (k, m) at ``time_s`` (k,) [s] of the instantaneous ``loads`` (k, m), which begin with a step."""
        shares, steps = np.array(self.series.shares, dtype=float), np.diff(time_s)
        if np.ptp(steps) < EVEN * steps[0]:
            steps = steps[:1]
        found = (1.0 - shares.sum()) * loads
        _add_branches(loads, shares, *self.series.factors(steps), found)
        return found


@dataclass(frozen=True)
class Fading:
    """G(t) = (1 + t/τ)^(−α): a straight line on paper with two logarithmic axes, after the first τ.

    exponent : α, not 1; time_s : τ [s]
    """

    exponent: float
    time_s: float

    def modulus(self, t: np.ndarray) -> np.ndarray:
        return (1.0 + np.asarray(t) / self.time_s) ** -self.exponent

    def respond(self, time_s: np.ndarray, loads: np.ndarray) -> np.ndarray:
        power, steps = 1.0 - self.exponent, np.diff(time_s)
        even = np.ptp(steps) < EVEN * steps[0]
        since = time_s - time_s[0] if even else np.maximum(time_s[:, None] - time_s, 0.0)
        passed = self.time_s / power * ((1.0 + since / self.time_s) ** power - 1.0)  # ∫ G
        whole = toeplitz(np.append(0.0, np.diff(passed)), np.zeros(len(steps))) if even else -np.diff(passed)
        return whole @ (np.diff(loads, axis=0) / steps[:, None]) + np.outer(self.modulus(time_s - time_s[0]), loads[0])


Kernel = Branches | Fading
"""A relaxation function."""


@numba.njit(cache=True, error_model="numpy")
def _add_branches(loads, shares, a, b, found):
    """Add Σ gᵢ hᵢ to ``found`` (k, m), where dh/dt = dF₀/dt − h/τ; a, b : (k − 1 or 1, n) factors of steps."""
    memory = np.empty((len(shares), loads.shape[1]))
    for i in range(len(shares)):
        memory[i] = loads[0]
    for k in range(len(loads)):
        step = min(k, len(a)) - 1
        for i in range(len(shares)):
            for m in range(loads.shape[1]):
                if k > 0:
                    memory[i, m] = a[step, i] * memory[i, m] + b[step, i] * (loads[k, m] - loads[k - 1, m])
                found[k, m] += shares[i] * memory[i, m]


RATES = 40
"""Rates, from a tenth of the slowest branch's to ten times the fastest's, at which operational moduli are compared."""


def shear_series(series: Series, poisson: float) -> Series:
    """Return the branches of the shear modulus, for ``series``, which are those of a press's force.

    poisson : Poisson's ratio of the relaxed tissue, whose resistance to a change of volume does not relax, as in
    ``palpate.effects.prony``. A force is that of the plane modulus M = 4 G (3 K + G) / (3 K + 4 G), which relaxes less
    than G where ν < 0.5. Solved for G at real rates of the Laplace transform, and fitted by as many branches (the
    correspondence principle: Lee 1955).
    """
    relaxed = Material(1.0, poisson, 1.0)
    shear, bulk = relaxed.shear_pa, relaxed.lame_pa + 2.0 / 3.0 * relaxed.shear_pa
    times = np.array(series.times_s, dtype=float)
    rates = np.geomspace(0.1 / times.max(), 10.0 / times.min(), RATES)
    plane = 1.0 / (1.0 - poisson**2) * _operational(series.ratios, times, rates)
    less = 12.0 * bulk - 4.0 * plane
    wanted = (np.sqrt(less**2 + 48.0 * plane * bulk) - less) / 8.0 / shear

    def away(logs: np.ndarray) -> np.ndarray:
        ratios, times = np.split(np.exp(logs), 2)
        return np.log(_operational(ratios, times, rates) / wanted)

    found = least_squares(away, np.log(np.append(series.ratios, times)), xtol=1e-12, ftol=1e-12, gtol=1e-12).x
    ratios, times = np.split(np.exp(found), 2)
    return Series((ratios / (1.0 + ratios.sum())).tolist(), times.tolist())


def _operational(ratios: np.ndarray, times_s: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Compute p times the Laplace transform of G(t)/G∞ at real ``rates`` p [1/s]."""
    passed = np.multiply.outer(rates, times_s)
    return 1.0 + passed / (1.0 + passed) @ ratios
