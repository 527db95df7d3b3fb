"""Judge laws by presses that they did not see: left out by place, depth, session, specimen, with rivals and floors.

The rivals are fitted alike, with offsets, places that differ and noise: a straight line and a power law take the place
of the forward model. Fitted to each press alone, they have its shallow half only. The floor is how well a repeat, or
the press at the nearest other place, predicts a press.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from palpate.errors import NotConverged
from palpate.identification.fit import Data, MixedModel, Options, Round, best_fit, fitted, rounded
from palpate.identification.forward import Parameter
from palpate.identification.progress import Follow, unfollowed
from palpate.table_declaration import Table

PLACE, DEPTH, SESSION, SPECIMEN = "place", "depth", "session", "specimen"
FOLDS = 5
SHALLOW = 0.5
"""Share of a press's largest depth that is fitted where deeper points are predicted."""
LEAST_POINTS = 2
"""Fewest points of a press on both sides of it."""
REPEAT, NEIGHBOUR = "repeat", "neighbour"
LINE, POWER_LAW = "line", "power_law"
OF_PLACE = "_of_place"

PREDICTIONS = Table(
    "predictions",
    "Error of forces of presses that a model did not see, by what was left out.",
    """
    by: what is left out: place, depth (beyond half of the largest), session or specimen
    model: a law; line and power_law, fitted alike to all or to one press (_of_place); repeat, neighbour: the floor
    press: its name
    error_share: root of the mean square error of its forces that were left out, over that of the forces
    bias_share: mean error over the mean force; positive where the prediction is too large
    """,
)


class PowerLaw:
    """Force in proportion to a power of depth, as a forward model that knows no mechanics."""

    relative_error = common_error = 0.0
    deepest_m = np.inf

    def __init__(self, low: float, high: float, reference_m: float):
        self.parameters, self.reference_m = (Parameter("exponent", low, high),), reference_m

    def forces(self, press: int, depth_m: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Return (d/d₀)ⁿ; see ``Forward``."""
        return (np.maximum(depth_m, 0.0) / self.reference_m) ** values["exponent"]


EXPONENTS = (0.5, 5.0)
"""Range of a power law's exponent."""


def predict(
    models: Mapping[str, MixedModel], best: Mapping[str, Mapping[str, float]], options: Options,
    ways: Sequence[str] = (PLACE, DEPTH, SESSION, SPECIMEN), spread_out: Callable[..., Iterable] = map,
    follow: Follow = unfollowed,
) -> pd.DataFrame:  # fmt: skip
    """Return the table of predictions by models of the same data, each started from its ``best`` unknown.

    A way that nothing can be left out by, such as one session, gives no rows. spread_out : map, or that of a pool
    """
    data = next(iter(models.values())).data
    rivals = {LINE: PowerLaw(1.0, 1.0, data.middle_m), POWER_LAW: PowerLaw(*EXPONENTS, data.middle_m)}
    others = {name: MixedModel.of(data, rival, options) for name, rival in rivals.items()}
    others[LINE] = replace(others[LINE], shapes=False)  # a line whose exponent differs is none
    starts = {name: best_fit(model)[0] for name, model in others.items()} | dict(best)
    everything = {**models, **others}
    around = {name: rounded(model, starts[name]) for name, model in everything.items()}
    parts = [(way, used) for way in ways for used in left_out(data, way, options.seed)]
    jobs = [(way, name, used) for way, used in parts for name in everything]
    rows = []
    for (way, name, used), force in zip(
        follow("predictions of presses left out", jobs),
        spread_out(lambda job: _refit(everything[job[1]], starts[job[1]], job[2], around[job[1]]), jobs), strict=True,
    ):  # fmt: skip
        rows += _rows(data, way, name, used, force)
    for way, used in parts:
        rows += _floor_rows(data, way, used)
        if way == DEPTH:
            rows += _rows(data, way, LINE + OF_PLACE, used, _alone(data, used, 1.0))
            rows += _rows(data, way, POWER_LAW + OF_PLACE, used, _alone(data, used, None))
    return PREDICTIONS.frame(rows)


def left_out(data: Data, way: str, seed: int) -> list[np.ndarray]:
    """Return which points (n,) are fitted, for each part of the data that is left out in turn."""
    layout = data.layout
    press = data.press_of_point
    if way == DEPTH:
        depth = layout.depth_m
        deepest = np.maximum.reduceat(depth, layout.press_start[:-1])[press]
        used = depth <= SHALLOW * deepest * (1 + 1e-9)
        enough = np.minimum(np.bincount(press, used), np.bincount(press, ~used)) >= LEAST_POINTS
        return [used] if enough.any() else []
    if way == PLACE:
        folds = np.arange(data.places) % min(FOLDS, data.places)
        fold = np.random.default_rng(seed).permutation(folds)[data.place_of_press]
    else:
        names = [getattr(data.records.presses[k], way) for k in data.order]
        fold = np.unique(names, return_inverse=True)[1]
    parts = [fold[press] != k for k in np.unique(fold)]
    return parts if len(parts) > 1 else []


def summary(predictions: pd.DataFrame) -> pd.DataFrame:
    """Return the median and ninetieth percentile of errors by what is left out and model, the best first."""
    grouped = predictions.groupby(["by", "model"], sort=False)
    found = grouped["error_share"].agg(median="median", p90=lambda e: e.quantile(0.9), presses="size")
    found["bias"] = grouped["bias_share"].median()
    return found.reset_index().sort_values(["by", "median"], kind="stable", ignore_index=True)


def _refit(model: MixedModel, start: Mapping[str, float], used: np.ndarray, around: Round) -> np.ndarray:
    """Return forces (n,) [N] by a fit to the points ``used`` (n,) alone; NaN where it does not converge."""
    part = replace(model, data=model.data.masked(used))
    try:
        unknown, _ = fitted(part, start, around=around)
    except NotConverged:
        return np.full(len(used), np.nan)
    return part.forces(unknown)


def _rows(data: Data, way: str, name: str, used: np.ndarray, force: np.ndarray) -> list[tuple]:
    """Return a row for each press that has points to predict, and that ``force`` (n,) is known of."""
    rows = []
    for k, number in enumerate(data.order):
        points = slice(data.layout.press_start[k], data.layout.press_start[k + 1])
        judged = ~used[points] & np.isfinite(force[points])
        if judged.sum() < LEAST_POINTS or (way == DEPTH and used[points].sum() < LEAST_POINTS):
            continue
        seen, off = data.layout.force_n[points][judged], (force - data.layout.force_n)[points][judged]
        size = np.sqrt(np.mean(seen**2))
        if size > 0.0:
            press = data.records.presses[number].name
            rows.append((way, name, press, float(np.sqrt(np.mean(off**2)) / size), float(off.mean() / size)))
    return rows


def _floor_rows(data: Data, way: str, used: np.ndarray) -> list[tuple]:
    """Return the rows of the floor: each press predicted by a repeat, or by the nearest other place, if there are such.

    Deeper points are predicted by the other press times the factor that fits the shallow ones.
    """
    layout, rows = data.layout, []
    presses = [data.records.presses[k] for k in data.order]
    places, number = data.place_of_press, np.arange(len(presses))
    seen_press = used[layout.press_start[:-1]]
    for name in (REPEAT, NEIGHBOUR) if way in (PLACE, DEPTH) else (NEIGHBOUR,):
        force = np.full(len(used), np.nan)
        for k in number if way == DEPTH else np.flatnonzero(~seen_press):
            if name == REPEAT:
                candidates = number[(places == places[k]) & (number != k)][:1]
            elif presses[k].at_m is None:
                continue
            else:
                candidates = number[places != places[k] if way in (PLACE, DEPTH) else seen_press]
                placed = [c for c in candidates if presses[c].at_m is not None]
                apart = [float(np.linalg.norm(presses[c].at_m - presses[k].at_m)) for c in placed]
                candidates = [c for _, c in sorted(zip(apart, placed, strict=True))]
            if not len(candidates):
                continue
            other = candidates[0]
            own, its = (slice(layout.press_start[p], layout.press_start[p + 1]) for p in (k, other))
            guess = np.interp(layout.depth_m[own], layout.depth_m[its], layout.force_n[its], right=np.nan)
            if way == DEPTH:
                seen = used[own] & np.isfinite(guess)
                below = float(guess[seen] @ guess[seen])
                guess = guess * float(guess[seen] @ layout.force_n[own][seen]) / below if below > 0 else guess * np.nan
            force[own] = guess
        rows += _rows(data, way, name, used, force)
    return rows


def _alone(data: Data, used: np.ndarray, exponent: float | None) -> np.ndarray:
    """Return forces (n,) [N] of k (d + s)ⁿ fitted to the points ``used`` of each press; n is 1 or is fitted too.

    Three numbers need three points; with two the shift s is none.
    """
    layout = data.layout
    found = np.full(len(used), np.nan)
    for first, end in zip(layout.press_start[:-1], layout.press_start[1:], strict=True):
        depth, force, seen = layout.depth_m[first:end], layout.force_n[first:end], used[first:end]
        deepest, strongest = depth.max(), np.abs(force[seen]).max(initial=0.0)
        if seen.sum() < LEAST_POINTS or strongest == 0.0:
            continue

        def curve(p: np.ndarray, depth: np.ndarray = depth, deepest: float = deepest) -> np.ndarray:
            return p[0] * np.maximum(depth / deepest + p[1], 1e-9) ** (p[2] if exponent is None else exponent)

        shifts = 0.25 if seen.sum() > 2 else 1e-9  # of the largest depth, as the offsets of all fits
        low, high = [0.0, -0.4 * shifts, EXPONENTS[0]], [np.inf, shifts, EXPONENTS[1]]
        free = 3 if exponent is None else 2
        at = least_squares(
            lambda p, curve=curve, seen=seen, force=force, strongest=strongest: (curve(p) - force)[seen] / strongest,
            [2.0 * strongest, 0.0, 1.5][:free], bounds=(low[:free], high[:free]),
        ).x  # fmt: skip
        found[first:end] = curve(at)
    return found
