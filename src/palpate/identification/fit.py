"""Fit a forward model to presses: modulus, law, first touch, scatter of places and noise, by maximum likelihood.

The optimisers are those of scipy. The modulus is fitted as E/(1 − ν²) where ν is free, because that is nearly
determined when E and ν are not.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import Bounds, minimize

from palpate.errors import InputError, NotConverged
from palpate.identification.force_table import ForceTable, tabulate
from palpate.identification.forward import Forward
from palpate.identification.mixed_effects import Layout, Modes, Spread, modes, no_effects
from palpate.identification.presses import Press, PressRecords

POINTS = 12
"""Points of a press that are fitted; of more, those nearest to even steps of depth."""
SHAPE_FLOOR = 0.1
"""Of the depth that exponents refer to: log depth is not taken below it, where noise decides."""
START = {"log_noise": np.log(0.05), "place": 0.2, "shape": 0.1, "offset_scatter": 0.2, "repeat": 0.05, "excess": 0.0}
BOUNDS = {
    "log_noise": (np.log(1e-3), np.log(0.7)), "place": (0.0, 3.0), "shape": (0.0, 2.0), "offset_scatter": (0.0, 1.0),
    "repeat": (0.0, 2.0), "excess": (-2.0, 2.0), "log_modulus": (-40.0, 40.0), "zero": (-1.0, 1.0),
    "slope": (-1.0, 1.0),
}  # fmt: skip
FLOORS = (1e-4, 30.0)
"""Bounds of the noise at small forces, over the median of the presses' largest."""
DIFFERENCE = 1e-5
"""Step of derivatives by differences; the likelihood is known to some 1e-9."""
SEARCH = {"maxiter": 200, "ftol": 1e-7, "eps": DIFFERENCE}
SCALED_SEARCH = {"maxiter": 12, "ftol": 1e-4, "eps": DIFFERENCE}
CURVED, FLATTEST = 1e-3, 1.0
"""Step of second differences, and the least curvature that coordinates are scaled by."""
CONVERGED, RESTARTS = 1e-2, 8
"""Change of −2 log likelihood that ends restarts, small beside the threshold of an interval, and most of them."""
SCATTERS = ((0.01, 1e-3), (0.01, 0.1), (0.2, 0.02))
"""Noise that searches begin with beside START's: its share, and that at small forces over the typical force. A row near
first touch with a noisy force makes the likelihood rough, so that some searches end far above the least value."""
STARTS = (-0.7, 0.7)
"""Places of parameters in their ranges that searches begin with beside the middle."""
AGREED, LOOSENED = 1.0, (2.0, 0.5, 4.0, 0.25)
"""How near the least −2 log likelihood of two searches has to be, and factors of the noise that more begin with."""


@dataclass(frozen=True)
class Options:
    """Options of a fit.

    offset_m : range of the mean offset of first touch [m]; None takes ``OFFSETS`` times the largest depth
    resamples : number of the bootstrap over places, 0 for none; seed : of its draws
    """

    offset_m: tuple[float, float] | None = None
    resamples: int = 60
    seed: int = 0


OFFSETS, FARTHEST = (-0.25, 0.1), 10.0
"""Range of the mean offset over the largest depth: a touch is noticed after it happened rather than before; and how far
before one that is given may be."""


def loading(press: Press) -> tuple[np.ndarray, np.ndarray]:
    """Return depths [m] and forces [N] (k,) of a press until its largest depth, at most ``POINTS`` of them."""
    end_sample = int(np.argmax(press.depth_m)) + 1
    touching = press.depth_m[:end_sample] >= 0.0
    depth, force = press.depth_m[:end_sample][touching], press.force_n[:end_sample][touching]
    if len(depth) > POINTS:
        even_depths = np.linspace(depth[0], depth[-1], POINTS)
        nearest = np.unique(np.abs(depth[:, None] - even_depths).argmin(axis=0))
        depth, force = depth[nearest], force[nearest]
    return depth, force


@dataclass(frozen=True, eq=False)
class Data:
    """Points of presses to fit, in the order of the places.

    layout : depths and forces of the points, and which belong to which press and place
    order : (presses,) the number that each press has in ``records``
    middle_m : geometric mean of the depths [m]; largest_m : the largest [m]
    typical_n : median of the presses' largest forces [N]
    """

    records: PressRecords
    layout: Layout
    order: np.ndarray
    middle_m: float
    largest_m: float
    typical_n: float

    @classmethod
    def of(cls, records: PressRecords) -> "Data":
        """Return the points of the records' presses, each of which goes deeper than 0."""
        keys = [(press.specimen, press.session, press.place or press.name) for press in records.presses]
        places = list(dict.fromkeys(keys))
        place_number = np.array([places.index(key) for key in keys], dtype=np.int64)
        order = np.argsort(place_number, kind="stable")
        curves = [loading(records.presses[k]) for k in order]
        depth = np.concatenate([depth for depth, _ in curves])
        middle_m = float(np.exp(np.log(depth[depth > 0.0]).mean()))
        layout = Layout(
            depth,
            force_n=np.concatenate([force for _, force in curves]),
            level=np.log(np.maximum(depth, SHAPE_FLOOR * middle_m) / middle_m),
            weight=np.ones(len(depth)),
            press_start=np.cumsum([0, *(len(depth) for depth, _ in curves)]),
            place_start=np.cumsum([0, *np.bincount(place_number)]),
            table=np.zeros(len(order), dtype=np.int64),
        )
        typical_n = float(np.median([np.abs(force).max() for _, force in curves]))
        return cls(records, layout, order, middle_m, float(depth.max()), typical_n)

    @property
    def places(self) -> int:
        """The number of places."""
        return len(self.layout.place_start) - 1

    @property
    def place_of_press(self) -> np.ndarray:
        """The number of each press's place, (presses,)."""
        return np.repeat(np.arange(self.places), np.diff(self.layout.place_start))

    @property
    def press_of_point(self) -> np.ndarray:
        """The number of each point's press, (n,)."""
        return np.repeat(np.arange(len(self.order)), np.diff(self.layout.press_start))

    def masked(self, used: np.ndarray) -> "Data":
        """Return the data of which only the points ``used`` (n,) are fitted, and the others predicted."""
        return replace(self, layout=self.layout._replace(weight=used.astype(float)))


@dataclass(frozen=True, eq=False)
class MixedModel:
    """The statistical model of presses: −2 log likelihood of the unknowns, by name, from a forward model and data.

    Unknowns are the forward model's free parameters and ``offset``, each in −1 … 1 of its range; ``log_modulus``, of E
    or of E/(1 − ν²) [log Pa]; and log_noise, log_floor, place, shape, offset_scatter, repeat and excess as in
    ``Spread``. The excess is common to all presses; the forward model's own error is its standard deviation.

    free_excess : whether the excess is free of that, so that the presses show which exponent of depth the law lacks
    lined : whether the sensor has unknowns, a ``zero`` over the typical force, a ``slope`` over that and largest depth
    shapes : whether places differ in the exponent of depth
    weights : (places,) how often each place counts; None for once
    """

    data: Data
    table: ForceTable
    offset_m: tuple[float, float]
    free_excess: bool = False
    lined: bool = False
    shapes: bool = True
    weights: np.ndarray | None = None

    @classmethod
    def of(cls, data: Data, forward: Forward, options: Options) -> "MixedModel":
        """Tabulate ``forward`` for all presses, up to the depth that offsets of first touch may add; return the model.

        InputError for an offset that is not in metres.
        """
        low, high = options.offset_m or (OFFSETS[0] * data.largest_m, OFFSETS[1] * data.largest_m)
        if not -FARTHEST * data.largest_m <= low <= high < data.largest_m:
            raise InputError(
                f"the offset of first touch is {low:g} to {high:g} m, and presses are {data.largest_m:g} m deep; give "
                "the smaller one first, in metres or with a unit (--offset -0.2mm:0.1mm)."
            )
        deepest = min(forward.deepest_m, data.largest_m - 1.5 * min(low, 0.0))
        table = tabulate(forward, data.order.tolist(), deepest)
        return cls(replace(data, layout=data.layout._replace(table=table.table)), table, (low, high))

    @property
    def parameters(self) -> list[str]:
        """Names of the forward model's free parameters."""
        return [p.name for p in self.table.free]

    @cached_property
    def names(self) -> list[str]:
        """Names of the unknowns."""
        names = [*self.parameters, "log_modulus"]
        if self.offset_m[1] > self.offset_m[0]:
            names += ["offset", "offset_scatter"]
        names += ["log_noise", "log_floor", "place", *["shape"] * self.shapes]
        if self.data.places < len(self.data.order):
            names.append("repeat")
        if self.free_excess or self.table.forward.relative_error > 0.0:
            names.append("excess")
        return [*names, *["zero", "slope"] * self.lined]

    def bounds(self, name: str) -> tuple[float, float]:
        """Return the least and the greatest value of an unknown."""
        if name in self.parameters or name == "offset":
            return -1.0, 1.0
        if name in ("place", "shape"):  # places differ at least by the errors that the forward model has there
            forward = self.table.forward
            return float(np.sqrt(forward.relative_error**2 - forward.common_error**2)), BOUNDS[name][1]
        if name == "log_floor":
            return float(np.log(FLOORS[0] * self.data.typical_n)), float(np.log(FLOORS[1] * self.data.typical_n))
        return BOUNDS[name]

    def offset_at(self, place: float) -> float:
        """Return the mean offset [m] at ``place`` in −1 … 1 of its range."""
        low, high = self.offset_m
        return low + (high - low) * 0.5 * (place + 1.0)

    def values(self, unknown: Mapping[str, float]) -> dict[str, float]:
        """Return the forward model's parameters in their units, with young_pa [Pa] and offset_m [m]."""
        place = np.array([unknown[name] for name in self.parameters])
        values = self.table.values(np.clip(place, -1.0, 1.0))
        return values | {
            "young_pa": float(np.exp(unknown["log_modulus"]) * self.confined(values)),
            "offset_m": self.offset_at(unknown.get("offset", -1.0)),
        }

    def confined(self, values: Mapping[str, float]) -> float:
        """Return E over the modulus that is fitted: 1 − ν² where ν is free."""
        return 1.0 - values["poisson"] ** 2 if "poisson" in self.parameters else 1.0

    def modes(self, unknown: Mapping[str, float], effects: np.ndarray | None = None) -> Modes:
        """Return −2 log likelihood of each place, and the predicted forces; effects : as ``mixed_effects.modes``."""
        values = self.values(unknown)
        half_range = 0.5 * (self.offset_m[1] - self.offset_m[0])
        spread = Spread(
            float(np.exp(unknown["log_noise"])), float(np.exp(unknown["log_floor"])), unknown["place"],
            unknown.get("shape", 0.0), unknown.get("repeat", 0.0), values["offset_m"],
            half_range * unknown.get("offset_scatter", 0.0), unknown.get("excess", 0.0),
        )  # fmt: skip
        logs, slopes = self.table.at(np.array([unknown[name] for name in self.parameters]))
        layout = self.data.layout
        if self.lined:
            line = unknown["zero"] + unknown["slope"] * layout.depth_m / self.data.largest_m
            layout = layout._replace(force_n=layout.force_n - self.data.typical_n * line)
        return modes(
            layout, logs, slopes, self.table.start, self.table.step, float(np.log(values["young_pa"])),
            spread, effects,
        )  # fmt: skip

    def forces(self, unknown: Mapping[str, float]) -> np.ndarray:
        """Return the predicted forces (n,) [N] of all points, with the effects of their places and presses."""
        return np.exp(np.minimum(self.modes(unknown).log_force, 600.0))

    def minus2(self, unknown: Mapping[str, float], effects: np.ndarray | None = None) -> float:
        """Return −2 log likelihood of all places, and of the excess by the forward model's own error."""
        each = self.modes(unknown, effects).minus2
        total = float(each.sum() if self.weights is None else self.weights @ each)
        error = self.table.forward.relative_error
        if error > 0.0 and not self.free_excess:
            total += (unknown.get("excess", 0.0) / error) ** 2
        return total

    def start(self) -> dict[str, float]:
        """Return unknowns to start a search from: parameters in the middle of their ranges, the modulus by a median.

        InputError where fewer than three forces are large enough to show a modulus.
        """
        unknown = {name: 0.0 for name in self.parameters} | {"log_modulus": 0.0}
        unknown |= {name: START[name] for name in self.names if name in START}
        unknown |= {"offset": 0.0} if "offset" in self.names else {}
        unknown["log_floor"] = float(np.log(0.01 * max(self.data.typical_n, 1e-9)))
        layout = self.data.layout
        without_effects = {"place": 0.0, "shape": 0.0, "offset_scatter": 0.0, "repeat": 0.0}
        log_model = self.modes(unknown | without_effects).log_force
        used = (layout.weight > 0) & (layout.force_n > 0.05 * self.data.typical_n) & (log_model > -100.0)
        if used.sum() < 3:
            raise InputError(f"{self.data.records.source}: no forces to fit; give presses that touch the tissue.")
        log_ratio = np.where(used, np.log(np.maximum(layout.force_n, 1e-300)) - log_model, 0.0)
        unknown["log_modulus"] = float(np.median(log_ratio[used]))
        return unknown | self._larger_scatters(log_ratio, used)

    def _larger_scatters(self, log_ratio: np.ndarray, used: np.ndarray) -> dict[str, float]:
        """Return standard deviations to start a search from, where those of START are too small for the presses.

        log_ratio : (n,) log of measured over model force, of which those ``used`` (n,) count
        A line over log depth is fitted to the ratios of each place: lines differ by ``place`` in height and by
        ``shape`` in slope. Trap: a search from scatters far too small for the places does not get away from them.
        """
        level, place_of_point = self.data.layout.level, self.data.place_of_press[self.data.press_of_point]
        points_by_place = [np.flatnonzero(used & (place_of_point == place)) for place in range(self.data.places)]
        lines, residuals = [], []
        for points in (each for each in points_by_place if len(each) > 2):
            lines.append(np.polyfit(level[points], log_ratio[points], 1))
            residuals.append(log_ratio[points] - np.polyval(lines[-1], level[points]))
        if len(lines) < 2:
            return {}
        shape, place = np.std(lines, axis=0)
        noise = max(float(np.std(np.concatenate(residuals))), 1e-3)
        larger = {
            name: float(min(value, BOUNDS[name][1]))
            for name, value in {"place": place, "shape": shape, "log_noise": np.log(noise)}.items()
            if name in self.names and value > START[name]
        }
        # noise that is large beside small forces makes the likelihood smooth
        return larger | ({"log_floor": float(np.log(self.data.typical_n))} if "log_noise" in larger else {})


@dataclass(frozen=True, eq=False)
class _FreeUnknowns:
    """The unknowns that a fit varies: all but those ``held``.

    young : log of E [log Pa] that is held in place of ``log_modulus``, or None
    """

    model: MixedModel
    held: Mapping[str, float]
    young: float | None

    @cached_property
    def names(self) -> list[str]:
        known = [*self.held, *["log_modulus"] * (self.young is not None)]
        return [name for name in self.model.names if name not in known]

    @cached_property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds (n,) of the free unknowns."""
        low, high = np.array([self.model.bounds(name) for name in self.names]).T
        return low, high

    def whole(self, free: np.ndarray) -> dict[str, float]:
        """Return all unknowns by name, given the free ones (n,)."""
        unknown = {**self.held, **dict(zip(self.names, map(float, free), strict=True))}
        if self.young is not None:
            place = np.array([unknown[name] for name in self.model.parameters])
            confined = self.model.confined(self.model.table.values(np.clip(place, -1, 1)))
            unknown["log_modulus"] = self.young - float(np.log(confined))
        return unknown

    def scaling(self, unknown: Mapping[str, float], effects: np.ndarray) -> np.ndarray | None:
        """Return W (n, n), with which −2 log likelihood near ``unknown`` curves alike along every z, free = W z.

        It is the inverse root of its Hessian, by second differences; None where the likelihood is not finite.
        """
        low, high = self.limits
        centre = np.clip([unknown[name] for name in self.names], low + 2.0 * CURVED, high - 2.0 * CURVED)
        n = len(centre)
        steps = CURVED * np.eye(n)
        middle = self.model.minus2(self.whole(centre), effects)
        ahead = [self.model.minus2(self.whole(centre + step), effects) for step in steps]
        differences = np.empty((n, n))
        for i in range(n):
            behind = self.model.minus2(self.whole(centre - steps[i]), effects)
            differences[i, i] = ahead[i] - 2.0 * middle + behind
            for j in range(i):
                ahead_of_both = self.model.minus2(self.whole(centre + steps[i] + steps[j]), effects)
                differences[i, j] = differences[j, i] = ahead_of_both - ahead[i] - ahead[j] + middle
        if not np.isfinite(differences).all():
            return None
        values, vectors = np.linalg.eigh(differences / CURVED**2)
        return vectors / np.sqrt(np.maximum(np.abs(values), FLATTEST))


Scaling = np.ndarray | None
"""W (n, n) of the free unknowns, as ``_FreeUnknowns.scaling`` returns it."""


def fitted(
    model: MixedModel, start: Mapping[str, float], held: Mapping[str, float] | None = None, young: float | None = None,
    scaling: Scaling = None,
) -> tuple[dict[str, float], float]:  # fmt: skip
    """Search for the greatest likelihood from ``start``; return the unknowns, and −2 log likelihood there.

    held : unknowns that are not fitted; young : log of E [log Pa] that is held, where ν is fitted
    scaling : by ``scaling_near`` with the same ones held, which saves most iterations
    NotConverged where the likelihood is nowhere finite.
    """
    free = _FreeUnknowns(model, dict(held or {}), young)
    lower, upper = free.limits
    effects = no_effects(model.data.layout)
    best_value, best_point = np.inf, np.clip([start[name] for name in free.names], lower, upper)
    lowest_seen = np.inf, best_point

    def minus2(x: np.ndarray) -> float:
        nonlocal lowest_seen
        result = model.minus2(free.whole(x), effects)
        if not np.isfinite(result):  # effects that are not finite would stay so
            effects[:] = 0.0
        elif result < lowest_seen[0]:
            lowest_seen = result, x.copy()
        return result

    for _ in range(RESTARTS):  # a quasi-Newton method may stop early in a narrow valley; a new one from there goes on
        end_point, end_value, iterations = _search(minus2, best_point, lower, upper, scaling)
        if scaling is not None and not np.isfinite([best_value, end_value]).any():
            scaling = None  # the start is too far from where the scaling was made: search again without it
            continue
        if not end_value <= lowest_seen[0] + CONVERGED:  # a line search may end above the lowest value that it has seen
            end_value, end_point = lowest_seen
        if not np.isfinite(end_value) or end_value > best_value:
            break
        gained, best_value, best_point = best_value - end_value, end_value, end_point
        if gained < CONVERGED or (scaling is not None and iterations < SCALED_SEARCH["maxiter"]):
            break
        scaling = free.scaling(free.whole(best_point), effects)
    if not np.isfinite(best_value):
        raise NotConverged("the likelihood of the presses has no finite value", [])
    return free.whole(best_point), best_value


def _search(
    minus2: Callable[[np.ndarray], float], start: np.ndarray, lower: np.ndarray, upper: np.ndarray, scaling: Scaling
) -> tuple[np.ndarray, float, int]:
    """Minimise ``minus2`` between bounds once, with a ``scaling`` in its coordinates z; return point, value and steps.

    start, lower, upper : (n,) free unknowns
    """
    if scaling is None:
        result = minimize(minus2, start, method="SLSQP", bounds=Bounds(lower, upper), options=SEARCH)
        return result.x, float(result.fun), result.nit
    constraint_slopes = np.concatenate([scaling, -scaling])
    constraint = {
        "type": "ineq", "jac": lambda z: constraint_slopes,
        "fun": lambda z: np.concatenate([start + scaling @ z - lower, upper - start - scaling @ z]),
    }  # fmt: skip
    result = minimize(
        lambda z: minus2(np.clip(start + scaling @ z, lower, upper)),
        np.zeros(len(start)), method="SLSQP", options=SCALED_SEARCH, constraints=constraint,
    )  # fmt: skip
    return np.clip(start + scaling @ result.x, lower, upper), float(result.fun), result.nit


def scaling_near(
    model: MixedModel, unknown: Mapping[str, float], held: Sequence[str] = (), young: bool = False
) -> Scaling:
    """Return the scaling of coordinates for fits near ``unknown``, in which ``held``, or E by ``young``, are held."""
    fixed = {name: unknown[name] for name in held}
    free = _FreeUnknowns(model, fixed, float(np.log(model.values(unknown)["young_pa"])) if young else None)
    return free.scaling(unknown, no_effects(model.data.layout))


def best_fit(model: MixedModel, sure: bool = False) -> tuple[dict[str, float], float]:
    """Search for the greatest likelihood from several starts; return the unknowns, and −2 log likelihood there.

    Starts differ in noise, then in parameters, then in noise about the best until two searches agree within AGREED.
    sure : whether to raise NotConverged where no two do
    """
    default = model.start()
    best, least = fitted(model, default)
    end_values = [least]

    def search(start: Mapping[str, float], margin: float) -> None:
        """Fit from ``start``; keep the result if its value is below the least one by more than ``margin``."""
        nonlocal best, least
        try:
            candidate, value = fitted(model, start)
        except NotConverged:
            return
        end_values.append(value)
        if value < least - margin:
            best, least = candidate, value

    typical = max(model.data.typical_n, 1e-9)
    for noise, floor in SCATTERS:
        search(default | {"log_noise": float(np.log(noise)), "log_floor": float(np.log(floor * typical))}, CONVERGED)
    for coordinate in STARTS if model.parameters else ():
        search(best | dict.fromkeys(model.parameters, coordinate), 0.0)
    for factor in LOOSENED:
        if np.sum(np.array(end_values) <= least + AGREED) > 1:
            return best, least
        shift = float(np.log(factor))
        search(best | {name: best[name] + shift for name in ("log_noise", "log_floor")}, CONVERGED)
    if sure and np.sum(np.array(end_values) <= least + AGREED) < 2:
        distances = ", ".join(f"{end_value - least:.3g}" for end_value in sorted(end_values)[1:4])
        raise NotConverged(
            f"the fit has not converged: searches end {distances} … above the best in −2 log likelihood", []
        )
    return best, least
