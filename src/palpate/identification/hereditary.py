"""Force over time of linear relaxation: F(t) = ∫ G(t − s) dF₀(s), F₀ being the force of tissue without time to relax.

F₀ is any function of depth. That G does not depend on depth is Fung's quasi-linear viscoelasticity (1993, section
7.6). Between samples F₀ is taken as linear in time, for which the integrals are exact. For a sphere that is pressed in
this is Lee and Radok's solution (1960).
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
        """Return G over its value at time 0, at times ``t`` (…) [s]."""
        return (1.0 - sum(self.series.shares)) * self.series.modulus(t)

    def respond(self, time_s: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """Return F (k, m) at ``time_s`` (k,) [s] for m courses of the instantaneous force, ``loads`` (k, m).

        The first samples are steps from 0.
        """
        shares, steps = np.array(self.series.shares, dtype=float), np.diff(time_s)
        if np.ptp(steps) < EVEN * steps[0]:
            steps = steps[:1]
        force = (1.0 - shares.sum()) * loads
        _add_branches(loads, shares, *self.series.factors(steps), force)
        return force


@dataclass(frozen=True)
class Fading:
    """G(t) = (1 + t/τ)^(−α), a power of time after the first τ.

    exponent : α, not 1; time_s : τ [s]
    """

    exponent: float
    time_s: float

    def modulus(self, t: np.ndarray) -> np.ndarray:
        """Return G at times ``t`` (…) [s]."""
        return (1.0 + np.asarray(t) / self.time_s) ** -self.exponent

    def respond(self, time_s: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """Return F (k, m), as ``Branches.respond``; time steps of equal length need a Toeplitz matrix only."""
        power, steps = 1.0 - self.exponent, np.diff(time_s)
        even = np.ptp(steps) < EVEN * steps[0]
        elapsed = time_s - time_s[0] if even else np.maximum(time_s[:, None] - time_s, 0.0)
        integral = self.time_s / power * ((1.0 + elapsed / self.time_s) ** power - 1.0)  # of G
        weights = toeplitz(np.append(0.0, np.diff(integral)), np.zeros(len(steps))) if even else -np.diff(integral)
        rates = np.diff(loads, axis=0) / steps[:, None]
        return weights @ rates + np.outer(self.modulus(time_s - time_s[0]), loads[0])


Kernel = Branches | Fading
"""A relaxation function."""


@numba.njit(cache=True, error_model="numpy")
def _add_branches(loads, shares, decay, gain, force):
    """Add Σ gᵢ hᵢ to ``force`` (k, m), where dhᵢ/dt = dF₀/dt − hᵢ/τᵢ, for loads F₀ (k, m) and shares gᵢ (n,).

    decay, gain : factors of hᵢ and of the change of F₀ in each step, (k − 1, n), or (1, n) if all are equal
    """
    memory = np.empty((len(shares), loads.shape[1]))
    for i in range(len(shares)):
        memory[i] = loads[0]
    for k in range(len(loads)):
        step = min(k, len(decay)) - 1
        for i in range(len(shares)):
            for m in range(loads.shape[1]):
                if k > 0:
                    memory[i, m] = decay[step, i] * memory[i, m] + gain[step, i] * (loads[k, m] - loads[k - 1, m])
                force[k, m] += shares[i] * memory[i, m]


RATES = 40
"""Number of rates, from a tenth of the slowest branch's to ten times the fastest's, at which moduli are compared."""


def shear_series(series: Series, poisson: float) -> Series:
    """Return the branches of the shear modulus G, from those of a press's force, ``series``.

    poisson : Poisson's ratio of the relaxed tissue
    The bulk modulus K does not relax, as in ``palpate.effects.prony``. The force of a press is in proportion to the
    plane modulus M = 4 G (3 K + G) / (3 K + 4 G), which relaxes less than G where ν < 0.5. By the correspondence
    principle (Lee 1955) it is solved for G at real rates of the Laplace transform, and as many branches are fitted.
    """
    relaxed = Material(1.0, poisson, 1.0)
    shear, bulk = relaxed.shear_pa, relaxed.lame_pa + 2.0 / 3.0 * relaxed.shear_pa
    times = np.array(series.times_s, dtype=float)
    rates = np.geomspace(0.1 / times.max(), 10.0 / times.min(), RATES)
    plane_modulus = 1.0 / (1.0 - poisson**2) * _operational(series.ratios, times, rates)
    # the positive root of 4 G² + (12 K − 4 M) G − 3 M K = 0
    linear_coefficient = 12.0 * bulk - 4.0 * plane_modulus
    shear_ratios = (np.sqrt(linear_coefficient**2 + 48.0 * plane_modulus * bulk) - linear_coefficient) / 8.0 / shear

    def residuals(logs: np.ndarray) -> np.ndarray:
        ratios, times = np.split(np.exp(logs), 2)
        return np.log(_operational(ratios, times, rates) / shear_ratios)

    start = np.log(np.append(series.ratios, times))
    ratios, times = np.split(np.exp(least_squares(residuals, start, xtol=1e-12, ftol=1e-12, gtol=1e-12).x), 2)
    return Series((ratios / (1.0 + ratios.sum())).tolist(), times.tolist())


def _operational(ratios: np.ndarray, times_s: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Return the operational modulus, p times the Laplace transform of G(t)/G∞, at real ``rates`` p [1/s]."""
    rate_times = np.multiply.outer(rates, times_s)
    return 1.0 + rate_times / (1.0 + rate_times) @ ratios
