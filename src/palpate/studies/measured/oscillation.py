"""A damped oscillation that creeps towards its rest: frequency, damping ratio and creep of a record or of a scene."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from palpate.errors import InputError

CREEP_S = 0.5
"""Where the search for the creep's time constant begins, in seconds or, if less, a quarter of the record."""


@dataclass(frozen=True)
class Oscillation:
    """y = rest + creep e^(−t/τ) + A e^(−ζωt) cos(ω √(1 − ζ²) t + φ).

    frequency_hz : ω / 2π, of the same body without damping [Hz]; damping_ratio : ζ
    amplitude_m : A at the first time [m]; creep_m : what it creeps from half a swing before, where it was let go, to
    its rest [m], over the time constant τ = ``creep_s`` [s]
    misfit : RMS that is left, as a share of the amplitude
    """

    frequency_hz: float
    damping_ratio: float
    amplitude_m: float
    creep_m: float
    creep_s: float
    misfit: float


def fit_oscillation(times: np.ndarray, y: np.ndarray, place: str, creeps: bool = True) -> Oscillation:
    """Fit a damped oscillation to ``y`` (n,) [m] at ``times`` (n,) [s], by least squares.

    What is linear is eliminated (Golub and Pereyra 1973); the frequency that begins the search is the best of many.
    Raises InputError, naming ``place``, for too few times and where no oscillation is seen.
    """
    t, duration = times - times[0], float(times[-1] - times[0])
    if len(t) < 12:
        raise InputError(f"{place} has {len(t)} rows after the release, too few for a frequency; set swings: false.")
    creep = min(CREEP_S, duration / 4)

    def left(unknowns: np.ndarray) -> np.ndarray:
        basis = _basis(t, unknowns, creeps)
        return basis @ np.linalg.lstsq(basis, y, rcond=None)[0] - y

    # from one swing in the record, up to a quarter of the sampling rate
    most = 0.25 / float(np.median(np.diff(t)))
    tries = [np.array([f, 0.03, creep]) for f in np.arange(1.0, most * duration, 0.25) / duration]
    start = min(tries, key=lambda unknowns: float(np.sum(left(unknowns) ** 2)))
    low, high = [0.5 * start[0], 0.0, creep / 4], [2.0 * start[0], 0.9, 4 * creep]
    scale = [0.1 * start[0], 0.01, 0.3 * creep]
    found = least_squares(left, start, bounds=(low, high), x_scale=scale, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    basis = _basis(t, found.x, creeps)
    amounts = np.linalg.lstsq(basis, y, rcond=None)[0]
    amplitude = float(np.hypot(*amounts[1:3]))
    misfit = float(np.sqrt(np.mean(found.fun**2))) / max(amplitude, 1e-300)
    if not misfit < 0.5:
        raise InputError(f"{place} shows no damped oscillation after the release; set swings: false for it.")
    frequency, ratio, constant = map(float, found.x)
    crept = -float(amounts[3] * np.exp(0.5 / (frequency * constant))) if creeps else 0.0
    return Oscillation(frequency, ratio, amplitude, crept, constant, misfit)


def _basis(t: np.ndarray, unknowns: np.ndarray, creeps: bool) -> np.ndarray:
    """Return the columns (n, 3 or 4) whose sum y is: rest, both phases of the oscillation, and creep.

    unknowns : frequency [Hz], damping ratio, time constant of the creep [s]
    """
    frequency, ratio, creep = unknowns
    omega = 2 * np.pi * frequency
    fading, angle = np.exp(-ratio * omega * t), omega * np.sqrt(1.0 - ratio**2) * t
    columns = [np.ones_like(t), fading * np.cos(angle), fading * np.sin(angle)]
    return np.column_stack([*columns, np.exp(-t / creep)] if creeps else columns)
