"""Forces of a forward model between the values that it was asked for: Chebyshev in its parameters, splines in depth.

A fit asks for forces some ten thousand times. log f is smooth in the parameters and nearly straight over log depth, so
that a few hundred values a press hold it (Trefethen, Approximation Theory and Approximation Practice, 2013, ch. 5).
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
    """Return a parameter's value at ``scaled`` in −1 … 1 of its range, which is that of its axis."""
    forth, back = AXES.get(parameter.name, (float, float))
    low, high = forth(parameter.low), forth(parameter.high)
    value = float(back(low + (high - low) * 0.5 * (scaled + 1.0)))
    return min(max(value, parameter.low), parameter.high)


@dataclass(frozen=True, eq=False)
class ForceTable:
    """Forces for young_pa = 1 Pa of every press, at any values of the parameters.

    forward : what was asked; nodes : (m,) Chebyshev points in −1 … 1 of each free parameter
    log_forces : (m^p, tables, depths); table : (presses,) of each press
    start, step : log of the least depth [log m] and spacing of the depths
    error : largest error found, as a share of the force
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
        return _free(self.forward)

    def values(self, place: np.ndarray) -> dict[str, float]:
        """Return all parameters by name at ``place`` (p,) in −1 … 1 of those that are free."""
        return _values(self.forward, self.free, place)

    def at(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return log f (tables, depths) and its slope over log depth at ``place`` (p,) in −1 … 1."""
        return self._at(tuple(map(float, place)))

    @cached_property
    def _at(self) -> Callable[[tuple[float, ...]], tuple[np.ndarray, np.ndarray]]:
        """``at``, that keeps the last answers: most steps of a fit leave the parameters as they are."""
        return lru_cache(KEPT)(self._interpolated)

    def _interpolated(self, place: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        weights = np.ones(1)
        for x in place:
            weights = np.multiply.outer(weights, _lagrange(self.nodes, float(x))).ravel()
        logs = (weights @ self.log_forces.reshape(len(weights), -1)).reshape(self.log_forces.shape[1:])
        return logs, logs @ self.slopes_of


def tabulate(forward: "Forward", order: Sequence[int], largest_m: float) -> ForceTable:
    """Fill a table of a forward model's forces up to a depth ``largest_m`` [m]; order : its numbers of the presses.

    Raises NotConverged if the model gives a force that is not positive.
    """
    free = _free(forward)
    logs = np.linspace(np.log(LEAST_DEPTH * largest_m), np.log(largest_m), DEPTHS)

    def ask(press: int, place: tuple[float, ...]) -> np.ndarray:
        values = _values(forward, free, place)
        forces = forward.forces(order[press], np.exp(logs), values)
        if not (np.isfinite(forces) & (forces > 0.0)).all():
            told = ", ".join(f"{name} {value:.3g}" for name, value in values.items())
            raise NotConverged(f"the model has no positive force at every depth with {told}", [float("nan")])
        return np.log(forces)

    probes = [tuple(place) for place in np.random.default_rng(0).uniform(-1, 1, (CHECKS, len(free)))]
    seen: list[np.ndarray] = []
    table, asked = np.empty(len(order), dtype=np.int64), []
    for press in range(len(order)):  # three values tell presses apart
        probe = np.concatenate([ask(press, place) for place in probes[:3]])
        same = [k for k, other in enumerate(seen) if np.abs(probe - other).max() < SAME]
        if not same:
            seen.append(probe)
            asked.append(press)
        table[press] = same[0] if same else len(seen) - 1
    slopes_of = CubicSpline(logs, np.eye(DEPTHS), axis=0)(logs, 1).T
    for count in _counts(len(free)):
        nodes = np.cos(np.pi * np.arange(count) / max(count - 1, 1))
        places = list(product(nodes, repeat=len(free)))
        values = np.array([[ask(press, place) for press in asked] for place in places])
        found = ForceTable(forward, nodes, values, table, logs[0], logs[1] - logs[0], slopes_of, 0.0)
        checked = range(0, len(asked), max(1, len(asked) // 5))
        off = [
            np.abs(found.at(np.array(place))[0][k] - ask(asked[k], place)).max() for place in probes for k in checked
        ]
        found = replace(found, error=float(max(off)))
        if found.error <= TOLERANCE:
            break
    return found


def _free(forward: "Forward") -> tuple["Parameter", ...]:
    return tuple(p for p in forward.parameters if p.high > p.low)


def _values(forward: "Forward", free: Sequence["Parameter"], place: Sequence[float] | np.ndarray) -> dict[str, float]:
    known = {p.name: p.low for p in forward.parameters}
    return known | {p.name: natural(p, x) for p, x in zip(free, place, strict=True)}


def _counts(free: int) -> list[int]:
    """Return how many nodes of each parameter are tried, from few to many."""
    if free == 0:
        return [1]
    first = {1: 7, 2: 6, 3: 5, 4: 4}.get(free, 3)
    counts = [first + more for more in (0, 2, 4, 8) if (first + more) ** free <= MOST_VALUES]
    return counts or [first]


def _lagrange(nodes: np.ndarray, x: float) -> np.ndarray:
    """Return the weights (m,) of values at Chebyshev points of the second kind, barycentric."""
    away = x - nodes
    if (hit := np.abs(away) < 1e-14).any():
        return hit.astype(float)
    signs = np.where(np.arange(len(nodes)) % 2 == 0, 1.0, -1.0)
    signs[[0, -1]] *= 0.5
    weights = signs / away
    return weights / weights.sum()
