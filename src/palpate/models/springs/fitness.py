"""Fitness of springs against a reference motion (paper 2, eq. 9), closed forms of moduli, and the stable step."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import NamedTuple

import numba
import numpy as np
from scipy.optimize import minimize_scalar

from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect
from palpate.effects.held import Held
from palpate.effects.kelvin import Kelvin
from palpate.effects.springs import Springs, sum_around_edges
from palpate.effects.volume_preservation import Volume, rest_distance_sum
from palpate.errors import InputError
from palpate.models.springs.spring_motion import Press, Settings, SpringModel, advance, constants, dampings, stiffnesses
from palpate.solvers.system import System, stable_step

LANES = (0,) * 16
"""As many individuals are advanced together, one in each lane of vector instructions: 3 times as fast as alone."""
ALPHA_S = 0.0025
"""α of eq. 9 [s]: the weight of velocities."""


@dataclass(frozen=True, eq=False)
class Fit:
    """The result of a search: ``young`` (n,) [Pa], its ``fitness`` [m], and the ``history`` of the search.

    history : (k, 3) evaluations so far, seconds so far, best fitness so far
    """

    young: np.ndarray
    fitness: float
    history: np.ndarray


class Range(NamedTuple):
    """The least and largest modulus of a search, ``low_pa`` and ``high_pa`` [Pa]."""

    low_pa: float
    high_pa: float


class Fitness:
    """f = −Σ_steps Σ_keys (‖r − rˢ‖ + α ‖v − vˢ‖) [m], with norms, since the paper's bare differences could cancel.

    positions [m] and velocities [m/s] : of the reference at the key points when compared, both (steps/every, p, 3)
    A motion that diverges has the fitness −∞. Each individual is computed in one lane of one thread: results are
    identical bit for bit for any number of threads.
    """

    def __init__(
        self, model: SpringModel, press: Press, settings: Settings, positions: np.ndarray, velocities: np.ndarray
    ):
        shape = (settings.steps // settings.every, len(settings.keys.corners), 3)
        for name, array in (("positions", positions), ("velocities", velocities)):
            if array.shape != shape or not np.isfinite(array).all():
                raise InputError(
                    f"reference of press {press.name}: {name} must be finite and of shape {shape}, not "
                    f"{array.shape}; compute the reference again."
                )
        self.model, self.press, self.settings = model, press, settings
        self.positions, self.velocities = positions, velocities
        self._constants = constants(model, press, settings)
        self._reference_arguments = (settings.keys.corners, settings.keys.shares, positions, velocities, settings.every)

    def of(self, model: SpringModel) -> "Fitness":
        """Return the fitness of other springs between the same nodes."""
        return Fitness(model, self.press, self.settings, self.positions, self.velocities)

    def __call__(self, young: np.ndarray) -> np.ndarray:
        """Compute the fitness (k,) [m] of individuals ``young`` (k, n) [Pa]."""
        stiffness = stiffnesses(self.model, young)
        damping = dampings(self.model, stiffness, self.settings.damping_ratio)
        lanes = _in_lanes(stiffness), _in_lanes(damping)
        fitness = np.empty(len(lanes[0]) * len(LANES))
        _evaluate(fitness, *lanes, *self._reference_arguments, *self._constants)
        fitness = fitness[: len(young)]
        return np.where(np.isfinite(fitness), fitness, -np.inf)


class Track:
    """A fitness that records its calls: the best individual, and a row of a ``Fit``'s history after each call."""

    def __init__(self, fitness: Callable[[np.ndarray], np.ndarray]):
        self._fitness, self._start, self._count = fitness, perf_counter(), 0
        self.best, self.young = -np.inf, np.empty(0)
        self.history: list[list[float]] = []

    def __call__(self, young: np.ndarray) -> np.ndarray:
        fitness = self._fitness(young)
        leader = int(np.argmax(fitness))
        if fitness[leader] > self.best or not self.history:
            self.best, self.young = float(fitness[leader]), young[leader].copy()
        self._count += len(young)
        self.history.append([self._count, perf_counter() - self._start, self.best])
        return fitness

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
    fitness, stiffness, damping, corners, shares, positions, velocities, every,
    nodes, pairs, rest, tetrahedra, volume_rest, volume, mobility, load, factors, h,
):  # fmt: skip
    """Write ``fitness`` for each lane of each block: minus the summed distances of its motion from the reference."""
    k = len(LANES)
    for block in numba.prange(len(stiffness)):
        x = nodes.repeat(k).reshape((len(nodes), 3 * k))
        v, force, work = np.zeros_like(x), np.empty_like(x), np.empty(12 * k)
        total, distances = np.zeros(k), np.empty(k)
        for s in range(len(factors)):
            advance(
                x, v, force, work, stiffness[block], damping[block], pairs, rest, tetrahedra, volume_rest, volume,
                mobility, load, factors[s], h, LANES,
            )  # fmt: skip
            if (s + 1) % every == 0:
                _sum_distances(x, corners, shares, positions[s // every], work, distances)
                total += distances
                _sum_distances(v, corners, shares, velocities[s // every], work, distances)
                total += ALPHA_S * distances
        fitness[block * k : (block + 1) * k] = -total


@numba.njit(cache=True, error_model="numpy")
def _sum_distances(values, corners, shares, wanted, work, total):
    """Write into ``total`` (lanes,) the summed distances of the key points in ``values`` from ``wanted`` (p, 3)."""
    k = len(LANES)
    total[:] = 0.0
    for p in range(len(corners)):
        for i in range(3):
            for j in range(i * k, (i + 1) * k):
                work[j] = -wanted[p, i]  # differences of the three coordinates, by lane
        for c in range(4):
            corner, share = values[corners[p, c]], shares[p, c]
            for j in range(3 * k):
                work[j] += share * corner[j]
        for j in range(k):
            total[j] += np.sqrt(work[j] * work[j] + work[k + j] * work[k + j] + work[2 * k + j] * work[2 * k + j])


STARTS = 12
"""Evaluations that bracket the best uniform modulus: the fitness may have several maxima."""


def van_gelder(model: SpringModel, material: Material) -> tuple[SpringModel, np.ndarray]:
    """Return moduli (n,) [Pa] of k = E ΣV/l² with the material's E everywhere (Van Gelder 1998), for the same model.

    Averaged over directions the network then has the modulus E, at a Poisson ratio of 1/4.
    """
    return model, np.full(len(model.masses), float(material.young_pa))


def lloyd(model: SpringModel, material: Material) -> tuple[SpringModel, np.ndarray]:
    """Set k = Σ (2√2/25) l E over the tetrahedra around a spring (Lloyd, Székely, Harders 2007).

    Derived for regular tetrahedra of edge l, by the least difference to the stiffness matrix of linear finite elements
    at a Poisson ratio of 1/4; there k is 24/25 of Van Gelder's. For other shapes l is, here, the edge of the regular
    tetrahedron of the same volume: the long and the short edges of an element get equal springs.
    """
    regular = np.cbrt(6.0 * np.sqrt(2.0) * TetMesh(model.nodes, model.tetrahedra).volumes)
    pairs, weights = sum_around_edges(model.tetrahedra, 2.0 * np.sqrt(2.0) / 25.0 * regular)
    assert np.array_equal(pairs, model.pairs)
    return replace(model, weights=weights), np.full(len(model.masses), float(material.young_pa))


CLOSED = {"van_gelder": van_gelder, "lloyd": lloyd}
"""Closed forms of moduli, which need no search."""


def uniform(fitness: Callable[[np.ndarray], np.ndarray], nodes: int, limits: Range) -> Fit:
    """Return the fittest modulus common to all ``nodes``: by even steps of log E, then Brent's method at the best."""
    track = Track(fitness)
    log_low, log_high = np.log(limits)
    logs = np.linspace(log_low, log_high, STARTS)
    best_row = int(np.argmax(track(np.exp(np.repeat(logs[:, None], nodes, axis=1)))))
    bracket = (logs[max(best_row - 1, 0)], logs[min(best_row + 1, STARTS - 1)])

    def unfitness(log: float) -> float:
        return -float(track(np.full((1, nodes), np.exp(log)))[0])

    minimize_scalar(unfitness, bounds=bracket, method="bounded", options={"xatol": 1e-4})
    return track.fit()


def volume_stiffness(model: SpringModel, material: Material) -> float:
    """Compute κ [N/m] of the volume force that gives springs of modulus E the material's bulk modulus; 0 below ν = 1/4.

    A swelling by ε costs springs ½ Σ k l² ε², which makes their bulk modulus 2E/3, and the volume force ½ κ ΣL² ε²,
    so 9V (E/(3 (1 − 2ν)) − 2E/3) = κ ΣL². In shear, L of a regular tetrahedron does not change.
    """
    missing = material.young_pa / (3.0 * (1.0 - 2.0 * material.poisson)) - 2.0 * material.young_pa / 3.0
    volume = float(TetMesh(model.nodes, model.tetrahedra).volumes.sum())
    return max(0.0, 9.0 * volume * missing / float((rest_distance_sum(model.nodes, model.tetrahedra) ** 2).sum()))


def step_limit(particles: Particles, model: SpringModel, settings: Settings, young_pa: float) -> float:
    """Return the longest step [s] that is stable about rest if all moduli are ``young_pa`` [Pa]."""
    stiffness = stiffnesses(model, np.full(len(model.masses), float(young_pa)))
    springs = Springs(model.pairs, stiffness, model.rest_m)
    effects: dict[str, Effect] = {"springs": springs, "kelvin": Kelvin(springs, model.masses, settings.damping_ratio)}
    if settings.volume_n_m > 0.0:
        effects["volume"] = Volume(particles, settings.volume_n_m)
    if len(model.held):
        effects["held"] = Held(model.held)
    return stable_step(System(particles, effects))
