"""Cross-validate laws: errors of forces of presses left out by place, depth, session or specimen, beside baselines.

Two baselines are fitted like laws, with offsets, places that differ and noise, with a straight line or a power law in
place of the forward model. Two more are fitted to the shallow half of each press alone. The last, the floor, predicts
a press by a repeat of it, or by the press at the nearest other place.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from palpate.errors import NotConverged
from palpate.identification.fit import Data, MixedModel, Options, Scaling, best_fit, fitted, scaling_near
from palpate.identification.forward import Parameter
from palpate.identification.progress import UNFOLLOWED, Progress

PLACE, DEPTH, SESSION, SPECIMEN = "place", "depth", "session", "specimen"
FOLDS = 5
SHALLOW = 0.5
"""Share of a press's largest depth that is fitted where deeper points are predicted."""
LEAST_POINTS = 2
"""Fewest points of a press on both sides of it."""
REPEAT, NEIGHBOUR = "repeat", "neighbour"
LINE, POWER_LAW = "line", "power_law"
OF_PLACE = "_of_place"

COLUMNS = ("by", "model", "press", "error_share", "bias_share")
"""Of predictions, as the study's table ``press_predictions`` describes them."""


class PowerLaw:
    """Force in proportion to a power of depth: a forward model without mechanics, as a baseline."""

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
    by: Sequence[str] = (PLACE, DEPTH, SESSION, SPECIMEN), progress: Progress = UNFOLLOWED,
) -> pd.DataFrame:  # fmt: skip
    """Return a table of COLUMNS: relative errors of forces at points that were left out, by laws and baselines.

    models : by law, of the same data; best : unknowns of each, from which fits start
    by : what points are left out by; one that divides nothing, such as a single session, gives no rows
    """
    data = next(iter(models.values())).data
    forwards = {LINE: PowerLaw(1.0, 1.0, data.middle_m), POWER_LAW: PowerLaw(*EXPONENTS, data.middle_m)}
    baselines = {name: MixedModel.of(data, forward, options) for name, forward in forwards.items()}
    baselines[LINE] = replace(baselines[LINE], shapes=False)  # the exponent of a line is 1 at all places
    starts = {name: best_fit(model)[0] for name, model in baselines.items()} | dict(best)
    everything = {**models, **baselines}
    scalings = {name: scaling_near(model, starts[name]) for name, model in everything.items()}
    # a fold: what is left out, and for each point whether fits see it
    folds = [(left_out, seen) for left_out in by for seen in fitted_points(data, left_out, options.seed)]
    jobs = [(left_out, name, seen) for left_out, seen in folds for name in everything]

    def refit(job: tuple[str, str, np.ndarray]) -> np.ndarray:
        _, name, seen = job
        return _refit(everything[name], starts[name], seen, scalings[name])

    rows, forces = [], progress.each("predictions of presses left out", refit, jobs)
    for (left_out, name, seen), force in zip(jobs, forces, strict=True):
        rows += _rows(data, left_out, name, seen, force)
    for left_out, seen in folds:
        rows += _floor_rows(data, left_out, seen)
        if left_out == DEPTH:
            rows += _rows(data, left_out, LINE + OF_PLACE, seen, _fit_each_press(data, seen, 1.0))
            rows += _rows(data, left_out, POWER_LAW + OF_PLACE, seen, _fit_each_press(data, seen, None))
    return pd.DataFrame(rows, columns=COLUMNS)


def fitted_points(data: Data, by: str, seed: int) -> list[np.ndarray]:
    """Return for each fold an array of truth values (n,): which points are fitted, while the others are left out.

    by : PLACE, in FOLDS random folds; DEPTH, one fold of points to SHALLOW; SESSION or SPECIMEN, one fold each
    """
    layout = data.layout
    press = data.press_of_point
    if by == DEPTH:
        depth = layout.depth_m
        deepest = np.maximum.reduceat(depth, layout.press_start[:-1])[press]
        used = depth <= SHALLOW * deepest * (1 + 1e-9)
        enough = np.minimum(np.bincount(press, used), np.bincount(press, ~used)) >= LEAST_POINTS
        return [used] if enough.any() else []
    if by == PLACE:
        folds = np.arange(data.places) % min(FOLDS, data.places)
        fold = np.random.default_rng(seed).permutation(folds)[data.place_of_press]
    else:
        names = [getattr(data.records.presses[k], by) for k in data.order]
        fold = np.unique(names, return_inverse=True)[1]
    parts = [fold[press] != k for k in np.unique(fold)]
    return parts if len(parts) > 1 else []


def summary(predictions: pd.DataFrame) -> pd.DataFrame:
    """Return the median and ninetieth percentile of errors by what is left out and model, the best first."""
    grouped = predictions.groupby(["by", "model"], sort=False)
    errors = grouped["error_share"].agg(median="median", p90=lambda e: e.quantile(0.9), presses="size")
    errors["bias"] = grouped["bias_share"].median()
    return errors.reset_index().sort_values(["by", "median"], kind="stable", ignore_index=True)


def _refit(model: MixedModel, start: Mapping[str, float], used: np.ndarray, scaling: Scaling) -> np.ndarray:
    """Fit a model to the points ``used`` (n,) alone; return the forces (n,) [N] of all, NaN if it does not converge."""
    part = replace(model, data=model.data.masked(used))
    try:
        unknown, _ = fitted(part, start, scaling=scaling)
    except NotConverged:
        return np.full(len(used), np.nan)
    return part.forces(unknown)


def _rows(data: Data, by: str, name: str, used: np.ndarray, force: np.ndarray) -> list[tuple]:
    """Return the rows of predictions of one model: relative errors of each press that has points to predict.

    used : (n,) which points were fitted; force : (n,) [N] predicted, NaN where it is not known
    """
    rows = []
    for k, number in enumerate(data.order):
        points = data.layout.points(k)
        judged = ~used[points] & np.isfinite(force[points])
        if judged.sum() < LEAST_POINTS or (by == DEPTH and used[points].sum() < LEAST_POINTS):
            continue
        measured, error = data.layout.force_n[points][judged], (force - data.layout.force_n)[points][judged]
        size = np.sqrt(np.mean(measured**2))
        if size > 0.0:
            press = data.records.presses[number].name
            rows.append((by, name, press, float(np.sqrt(np.mean(error**2)) / size), float(error.mean() / size)))
    return rows


def _floor_rows(data: Data, by: str, used: np.ndarray) -> list[tuple]:
    """Return the rows of the floor: each press predicted by its first repeat, and by that at the nearest other place.

    Where deeper points are predicted, the other press is scaled by the factor that fits the shallow ones.
    """
    layout, rows = data.layout, []
    presses, places = [data.records.presses[k] for k in data.order], data.place_of_press.tolist()
    is_fitted = used[layout.press_start[:-1]].tolist()

    def repeats(k: int) -> list[int]:
        return [other for other, place in enumerate(places) if place == places[k] and other != k]

    def neighbours(k: int) -> list[int]:
        """Return presses of other places, or of sessions or specimens that are fitted, the nearest first."""
        if (at := presses[k].at_m) is None:
            return []
        others = [c for c in range(len(presses)) if (places[c] != places[k] if by in (PLACE, DEPTH) else is_fitted[c])]
        distances = {c: float(np.linalg.norm(spot - at)) for c in others if (spot := presses[c].at_m) is not None}
        return sorted(distances, key=lambda c: distances[c])

    floors = {REPEAT: repeats, NEIGHBOUR: neighbours} if by in (PLACE, DEPTH) else {NEIGHBOUR: neighbours}
    for name, candidates in floors.items():
        force = np.full(len(used), np.nan)
        for k in range(len(presses)):
            if (is_fitted[k] and by != DEPTH) or not (donors := candidates(k)):
                continue
            points, donor = layout.points(k), layout.points(donors[0])
            guess = np.interp(layout.depth_m[points], layout.depth_m[donor], layout.force_n[donor], right=np.nan)
            if by == DEPTH:
                shallow = used[points] & np.isfinite(guess)
                square = float(guess[shallow] @ guess[shallow])
                factor = float(guess[shallow] @ layout.force_n[points][shallow])
                guess = guess * factor / square if square > 0 else guess * np.nan
            force[points] = guess
        rows += _rows(data, by, name, used, force)
    return rows


def _fit_each_press(data: Data, used: np.ndarray, exponent: float | None) -> np.ndarray:
    """Fit k (d + s)ⁿ to the points ``used`` (n,) of each press alone; return the forces (n,) [N] of all points.

    exponent : n, or None where it is fitted, too
    ``unknowns`` are k, s over the largest depth, and n. Three need three points; with two points s is 0.
    """
    layout = data.layout
    forces = np.full(len(used), np.nan)
    for start, end in zip(layout.press_start[:-1], layout.press_start[1:], strict=True):
        depth, force, seen = layout.depth_m[start:end], layout.force_n[start:end], used[start:end]
        deepest, strongest = depth.max(), np.abs(force[seen]).max(initial=0.0)
        if seen.sum() < LEAST_POINTS or strongest == 0.0:
            continue

        def curve(p: np.ndarray, depth: np.ndarray = depth, deepest: float = deepest) -> np.ndarray:
            return p[0] * np.maximum(depth / deepest + p[1], 1e-9) ** (p[2] if exponent is None else exponent)

        shifts = 0.25 if seen.sum() > 2 else 1e-9  # over the largest depth, as the offsets of all fits
        low, high = [0.0, -0.4 * shifts, EXPONENTS[0]], [np.inf, shifts, EXPONENTS[1]]
        n_free = 3 if exponent is None else 2
        unknowns = least_squares(
            lambda p, curve=curve, seen=seen, force=force, strongest=strongest: (curve(p) - force)[seen] / strongest,
            [2.0 * strongest, 0.0, 1.5][:n_free], bounds=(low[:n_free], high[:n_free]),
        ).x  # fmt: skip
        forces[start:end] = curve(unknowns)
    return forces
