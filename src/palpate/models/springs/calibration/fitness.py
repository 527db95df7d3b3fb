"""Fitness of springs against a reference motion, for a population at a time (paper 2, eq. 9)."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numba
import numpy as np

from palpate.errors import InputError
from palpate.models.springs.calibration.spring_model import Press, SpringModel
from palpate.models.springs.calibration.spring_motion import Settings, advance, constants, dampings, stiffnesses

LANES = (0,) * 16
"""As many individuals are advanced together, one in each lane of vector instructions: 3 times as fast as alone."""
ALPHA_S = 0.0025
"""α of eq. 9 [s]: the weight of velocities."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of a search: ``young`` (n,) [Pa], its ``fitness`` [m], and its ``history``.

    history : (k, 3) evaluations so far, seconds so far, best fitness so far
    """

    young: np.ndarray
    fitness: float
    history: np.ndarray


@dataclass(frozen=True)
class Range:
    """Moduli that a search may use, from ``low_pa`` to ``high_pa`` [Pa]; InputError if the range is empty."""

    low_pa: float
    high_pa: float

    def __post_init__(self):
        if not 0.0 < self.low_pa < self.high_pa < np.inf:
            raise InputError(
                f"springs.young_pa is from {self.low_pa:g} to {self.high_pa:g} Pa; "
                "give two positive numbers, the smaller one first."
            )


class Fitness:
    """f = −Σ_steps Σ_keys (‖r − rˢ‖ + α ‖v − vˢ‖) [m], with norms, since the paper's bare differences could cancel.

    positions [m] and velocities [m/s] : of the reference at the key points when compared, both (steps/every, p, 3)
    ``evaluations`` counts individuals. Each is computed in one lane of one thread, so that results are identical bit
    for bit for any number of threads. An individual whose motion diverges has the fitness −inf.
    """

    def __init__(
        self, model: SpringModel, press: Press, settings: Settings, positions: np.ndarray, velocities: np.ndarray
    ):
        wanted = (settings.steps // settings.every, len(settings.keys.corners), 3)
        for name, array in (("positions", positions), ("velocities", velocities)):
            if array.shape != wanted or not np.isfinite(array).all():
                raise InputError(
                    f"reference of press {press.name}: {name} must be finite and of shape {wanted}, not "
                    f"{array.shape}; compute the reference again."
                )
        self.model, self.press, self.settings = model, press, settings
        self.positions, self.velocities = positions, velocities
        self.evaluations = 0
        self._constants = constants(model, press, settings)
        self._wanted = (settings.keys.corners, settings.keys.shares, positions, velocities, settings.every)

    def __call__(self, young: np.ndarray) -> np.ndarray:
        """Compute the fitness (k,) [m] of individuals ``young`` (k, n) [Pa]."""
        stiffness = stiffnesses(self.model, young)
        damping = dampings(self.model, stiffness, self.settings.damping_ratio)
        lanes = _in_lanes(stiffness), _in_lanes(damping)
        found = np.empty(len(lanes[0]) * len(LANES))
        _evaluate(found, *lanes, *self._wanted, *self._constants)
        found = found[: len(young)]
        self.evaluations += len(young)
        return np.where(np.isfinite(found), found, -np.inf)


class Track:
    """Record of a fitness's calls: the best individual and, after each call, a row of a ``Fit``'s history."""

    def __init__(self, fitness: Callable[[np.ndarray], np.ndarray]):
        self._fitness, self._start, self._count = fitness, perf_counter(), 0
        self.best, self.young = -np.inf, np.empty(0)
        self.history: list[list[float]] = []

    def __call__(self, young: np.ndarray) -> np.ndarray:
        found = self._fitness(young)
        leader = int(np.argmax(found))
        if found[leader] > self.best or not self.history:
            self.best, self.young = float(found[leader]), young[leader].copy()
        self._count += len(young)
        self.history.append([self._count, perf_counter() - self._start, self.best])
        return found

    def fit(self) -> Fit:
        """Return the result so far."""
        return Fit(self.young, self.best, np.array(self.history))


def _in_lanes(values: np.ndarray) -> np.ndarray:
    """Fold (k, s) into (blocks, s, lanes); the last block is filled up with the last row."""
    blocks = -(-len(values) // len(LANES))
    rows = np.minimum(np.arange(blocks * len(LANES)), len(values) - 1)
    return np.ascontiguousarray(values[rows].reshape(blocks, len(LANES), -1).swapaxes(1, 2))


@numba.njit(cache=True, parallel=True, error_model="numpy")
def _evaluate(
    found, stiffness, damping, corners, shares, positions, velocities, every,
    nodes, pairs, rest, tetrahedra, volume_rest, volume, mobility, load, factors, h,
):  # fmt: skip
    k = len(LANES)
    for block in numba.prange(len(stiffness)):
        x = nodes.repeat(k).reshape((len(nodes), 3 * k))
        v, force, work = np.zeros_like(x), np.empty_like(x), np.empty(12 * k)
        total, part = np.zeros(k), np.empty(k)
        for s in range(len(factors)):
            advance(
                x, v, force, work, stiffness[block], damping[block], pairs, rest, tetrahedra, volume_rest, volume,
                mobility, load, factors[s], h, LANES,
            )  # fmt: skip
            if (s + 1) % every == 0:
                _sum_distances(x, corners, shares, positions[s // every], work, part)
                total += part
                _sum_distances(v, corners, shares, velocities[s // every], work, part)
                total += ALPHA_S * part
        found[block * k : (block + 1) * k] = -total


@numba.njit(cache=True, error_model="numpy")
def _sum_distances(values, corners, shares, wanted, work, total):
    """Sum the distances of the key points from their reference, in each lane, into ``total`` (lanes,)."""
    k = len(LANES)
    total[:] = 0.0
    for p in range(len(corners)):
        for i in range(3):
            for j in range(i * k, (i + 1) * k):
                work[j] = -wanted[p, i]
        for c in range(4):
            corner, share = values[corners[p, c]], shares[p, c]
            for j in range(3 * k):
                work[j] += share * corner[j]
        for j in range(k):
            total[j] += np.sqrt(work[j] * work[j] + work[k + j] * work[k + j] + work[2 * k + j] * work[2 * k + j])
