"""Interpolate the forces of a forward model: by Chebyshev polynomials in its parameters, by splines in depth.

A fit evaluates forces some ten thousand times. The log of force is smooth in the parameters and nearly straight over
log depth, so that a few hundred values a press determine it (Trefethen, Approximation Theory and Approximation
Practice, 2013, ch. 5).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicSpline

from palpate.errors import NotConverged

if TYPE_CHECKING:
    from palpate.identification.forward import Forward, Parameter

DEPTHS, LEAST_DEPTH = 25, 0.01
"""Depths of a table, and the least as a share of the largest; log f is straight below it."""
TOLERANCE, CHECKS = 2e-3, 6
"""Largest error of an interpolated force as a share, and at how many values drawn at random it is looked for."""
MOST_VALUES = 1300
"""Most values of the parameters that a table is filled at."""
KEPT = 16
"""Answers that a table keeps."""
SAME = 1e-9
"""Presses whose forces differ by less, as a share, share a table."""
AXES = {"thickness_m": (np.log, np.exp), "stiffening": (np.log1p, np.expm1)}
"""What is taken of a parameter before its range is divided, and the inverse; of others nothing."""


def natural(parameter: "Parameter", scaled: float) -> float:
    """Return the value of a parameter at the coordinate ``scaled`` in −1 … 1 of its range, along the axis of AXES."""
    forth, back = AXES.get(parameter.name, (float, float))
    low, high = forth(parameter.low), forth(parameter.high)
    value = float(back(low + (high - low) * 0.5 * (scaled + 1.0)))
    return min(max(value, parameter.low), parameter.high)


@dataclass(frozen=True, eq=False)
class ForceTable:
    """Table of a forward model's forces of every press for young_pa = 1 Pa, interpolated in the p free parameters.

    forward : the model; nodes : (m,) Chebyshev points in −1 … 1 of each free parameter
    log_forces : (m^p, tables, depths) log of force [log N]; table : (presses,) number of each press's table
    start, step : log of the least depth [log m] and spacing of the log depths
    slopes_of : (depths, depths), matrix from values over log depth to their slopes
    error : largest relative error of force that was measured between the nodes
    """

    forward: "Forward"
    nodes: np.ndarray
    log_forces: np.ndarray
    table: np.ndarray
    start: float
    step: float
    slopes_of: np.ndarray
    error: float

    @cached_property
    def free(self) -> tuple["Parameter", ...]:
        """The parameters that have a range."""
        return tuple(parameter for parameter in self.forward.parameters if parameter.high > parameter.low)

    def values(self, place: Sequence[float] | np.ndarray) -> dict[str, float]:
        """Return the values of all parameters by name, those that are free at ``place`` (p,) in −1 … 1."""
        known = {parameter.name: parameter.low for parameter in self.forward.parameters}
        return known | {p.name: natural(p, x) for p, x in zip(self.free, place, strict=True)}

    def at(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Interpolate log force (tables, depths), and its slope over log depth, at ``place`` (p,) in −1 … 1."""
        return self._at(tuple(map(float, place)))

    @cached_property
    def _at(self) -> Callable[[tuple[float, ...]], tuple[np.ndarray, np.ndarray]]:
        """The function behind ``at``, with a cache: most steps of a fit leave the parameters as they are."""
        return lru_cache(KEPT)(self._interpolated)

    def _interpolated(self, place: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        weights = np.ones(1)
        for x in place:
            weights = np.multiply.outer(weights, _lagrange(self.nodes, float(x))).ravel()
        logs = (weights @ self.log_forces.reshape(len(weights), -1)).reshape(self.log_forces.shape[1:])
        return logs, logs @ self.slopes_of


def tabulate(forward: "Forward", order: Sequence[int], largest_m: float) -> ForceTable:
    """Evaluate a forward model up to the depth ``largest_m`` [m] at ever more nodes, until the table's error is small.

    order : the model's number of each press
    Raises NotConverged if the model gives a force that is not positive.
    """
    log_depths = np.linspace(np.log(LEAST_DEPTH * largest_m), np.log(largest_m), DEPTHS)
    slopes_of = CubicSpline(log_depths, np.eye(DEPTHS), axis=0)(log_depths, 1).T
    start, step = log_depths[0], log_depths[1] - log_depths[0]
    table = np.empty(len(order), dtype=np.int64)
    tabulated = ForceTable(forward, np.empty(0), np.empty(0), table, start, step, slopes_of, np.inf)
    free_count = len(tabulated.free)

    def log_forces(press: int, place: tuple[float, ...]) -> np.ndarray:
        values = tabulated.values(place)
        forces = forward.forces(order[press], np.exp(log_depths), values)
        if not (np.isfinite(forces) & (forces > 0.0)).all():
            words = ", ".join(f"{name} {value:.3g}" for name, value in values.items())
            raise NotConverged(f"the model has no positive force at every depth with {words}", [float("nan")])
        return np.log(forces)

    # presses whose forces agree at three places in the parameters' ranges share the table of the first of them
    between = [tuple(place) for place in np.random.default_rng(0).uniform(-1, 1, (CHECKS, free_count))]
    samples: list[np.ndarray] = []
    table_presses = []
    for press in range(len(order)):
        sample = np.concatenate([log_forces(press, place) for place in between[:3]])
        equal_tables = [k for k, other in enumerate(samples) if np.abs(sample - other).max() < SAME]
        if not equal_tables:
            samples.append(sample)
            table_presses.append(press)
        table[press] = equal_tables[0] if equal_tables else len(samples) - 1
    checked = range(0, len(table_presses), max(1, len(table_presses) // 5))
    for count in _node_counts(free_count):
        nodes = np.cos(np.pi * np.arange(count) / max(count - 1, 1))
        values = [[log_forces(press, place) for press in table_presses] for place in product(nodes, repeat=free_count)]
        tabulated = replace(tabulated, nodes=nodes, log_forces=np.array(values))
        errors = [
            np.abs(tabulated.at(np.array(place))[0][k] - log_forces(table_presses[k], place)).max()
            for place in between
            for k in checked
        ]
        tabulated = replace(tabulated, error=float(max(errors)))
        if tabulated.error <= TOLERANCE:
            break
    return tabulated


def _node_counts(free_count: int) -> list[int]:
    """Return the numbers of nodes of each of ``free_count`` parameters that are tried in turn, from few to many."""
    if free_count == 0:
        return [1]
    fewest = {1: 7, 2: 6, 3: 5, 4: 4}.get(free_count, 3)
    counts = [fewest + more for more in (0, 2, 4, 8) if (fewest + more) ** free_count <= MOST_VALUES]
    return counts or [fewest]


def _lagrange(nodes: np.ndarray, x: float) -> np.ndarray:
    """Return the barycentric weights (m,) at ``x`` of values at Chebyshev points of the second kind, ``nodes`` (m,)."""
    distances = x - nodes
    if (at_node := np.abs(distances) < 1e-14).any():
        return at_node.astype(float)
    signs = np.where(np.arange(len(nodes)) % 2 == 0, 1.0, -1.0)
    signs[[0, -1]] *= 0.5
    weights = signs / distances
    return weights / weights.sum()
