"""Measure how wrong a portable model is between its contacts, and make nine answers in ten keep the bound they give."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import nnls

from palpate.benchmark.conformal import bound_factor
from palpate.benchmark.load import Load, Press
from palpate.errors import NotConverged
from palpate.models.contact_modes.contact_modes import ContactModes
from palpate.press.portable.runtimes.palpate_model import APART, PortableModel

EVERY = 4
"""Of the presses that a contact's snapshots are made of, each so many-th is asked for."""
AT_CONTACTS, PAIRS = 12, 6
"""Contacts at which the file is compared with what it was made of, and pairs of places that are pressed at once."""
LEAST = 1e-3
"""Smallest error that is said."""

BELIEVED, ALONE, BEYOND = 0.0, 1.0, 2.0
"""An answer that the file believes, one far from every contact, and one that is doubted for what was asked."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """The errors that were measured, as RMSE over peak.

    floor, share, spread, several : of an answer's bound, as docs/portable-model.md has it
    peak_m : median peak of the hardest presses [m]; stored : largest error at the contacts themselves
    errors, bounds : (k,) between contacts; places, pairs : how many; held : how many answers keep a bound made without
        their place, in one; paired : (p,) errors of two presses at once
    answered : how many presses between the contacts the file believes, in one; where none is, errors are of the others
    """

    floor: float
    share: float
    spread: float
    several: float
    peak_m: float
    stored: float
    errors: np.ndarray
    places: int
    held: float
    paired: np.ndarray
    answered: float

    def scalars(self) -> dict[str, float]:
        """Return the numbers that runtimes need."""
        found = {"floor": self.floor, "share": self.share, "spread": self.spread, "several": self.several}
        return found | {"peak_m": self.peak_m}

    def told(self) -> dict[str, object]:
        """Return what the header says."""
        two = (
            f"; {100 * self.paired.mean():.1f} % for two presses at once, of {len(self.paired)}"
            if len(self.paired)
            else ""
        )
        between = "not measured: there is no place between the contacts"
        if len(self.errors):
            kept = f"{100 * self.held:.0f} % of the answers keep the bound they give"
            measured = f"{len(self.errors)} presses at {self.places} places{two}"
            kept += f"; {100 * self.answered:.0f} % of the presses tried are believed, more with more contacts"
            mean, most = 100 * self.errors.mean(), 100 * self.errors.max()
            between = (
                f"between contacts {mean:.1f} % on average, {most:.1f} % at worst, of {measured}; RMSE over peak, "
                f"against contact modes that were prepared there; {kept}"
            )
        return {"error": between, "float32_error": self.stored}


def calibrate(
    model: PortableModel,
    surface: np.ndarray,
    solver: ContactModes,
    best: ContactModes,
    nodes: Sequence[int],
    checked: Sequence[int],
    progress: Callable[[Sequence], Iterable] = iter,
) -> Calibration:
    """Compare the file's ``model`` with ``best`` at the nodes ``checked``, and with ``solver`` at its own ``nodes``.

    surface : (n,) the numbers of the fine surface nodes; progress : wraps ``checked``
    """
    rows, peaks = [], []
    for node in progress(checked):
        for i, force in enumerate(best.shop.shown(node, "snapshots").forces[::EVERY]):
            row = _compared(model, surface, best, ((node, force),))
            if row is not None:
                rows.append((node, *row))
                peaks += [row[3]] if i == 0 else []
    own = [_compared(model, surface, solver, ((node, 0.5 * _hardest(solver, node)),)) for node in nodes[:AT_CONTACTS]]
    stored = max((row[0] for row in own if row is not None), default=0.0)
    peak = float(np.median(peaks)) if peaks else 0.0
    if not rows:
        return Calibration(stored + LEAST, 0.1, 1.0, 1.0, peak, stored, np.empty(0), 0, 0.0, np.empty(0), 1.0)
    table = np.array(rows)
    answered = float((table[:, 6] == BELIEVED).mean())
    table = table[table[:, 6] == table[:, 6].min()]
    place, error = table[:, 0], table[:, 1]
    parts = np.column_stack([np.full(len(error), stored + LEAST), table[:, 2:4]])
    weights = _fit(parts, error, place)
    half = np.isin(place, np.unique(place)[::2])
    held = [
        error[~side] <= parts[~side] @ _fit(parts[side], error[side], place[side])
        for side in (half, ~half)
        if side.any()
    ]
    pairs, several = _pairs(model, surface, best, solver, checked, weights, stored + LEAST)
    floor, share, spread = weights * [stored + LEAST, 1.0, 1.0]
    covered = float(np.concatenate(held).mean()) if len(held) else 0.0
    return Calibration(floor, share, spread, several, peak, stored, error, len(set(place)), covered, pairs, answered)


def _fit(parts: np.ndarray, error: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return weights (3,) of the ``parts`` (k, 3) of a bound that holds in nine of ten answers at a new place."""
    weights, _ = nnls(parts / error[:, None], np.ones(len(error)))
    weights[0] = max(weights[0], 1.0)
    scores = error / (parts @ weights)
    factor = bound_factor(scores, place)
    return weights * (factor if np.isfinite(factor) else float(scores.max()))


def _pairs(
    model: PortableModel,
    surface: np.ndarray,
    best: ContactModes,
    solver: ContactModes,
    checked: Sequence[int],
    weights: np.ndarray,
    floor: float,
) -> tuple[np.ndarray, float]:
    """Return errors (p,) of two presses at once, half as hard as they may be, and what they add to the bound."""
    errors: list[float] = []
    more: list[float] = []
    for one, two in list(pairwise(checked))[:PAIRS]:
        row = _compared(model, surface, best, tuple((node, 0.5 * _hardest(solver, node)) for node in (one, two)))
        if row is not None:
            errors.append(row[0])
            more.append(max(0.0, row[0] - float(weights @ np.array([floor, row[1], row[2]]))) / max(row[4], 1e-9))
    return np.array(errors), float(np.max(more, initial=0.0))


def _hardest(solver: ContactModes, node: int) -> np.ndarray:
    """Return the hardest straight press (3,) [N] that a contact bears."""
    bearing = solver.prepare_contact(node).bearing[0]
    return bearing / float(bearing @ bearing)


def _compared(
    model: PortableModel, surface: np.ndarray, solver: ContactModes, presses: Sequence[tuple[int, np.ndarray]]
) -> tuple[float, float, float, float, float, float] | None:
    """Return error, size and spread over the peak, the peak [m], and the size of all presses but the largest over it.

    The last is how far the file doubts: BELIEVED, ALONE or BEYOND. None where ``solver`` believes none.
    """
    try:
        right = solver.respond(Load(tuple(Press(node, force) for node, force in presses))).displacement
    except NotConverged:
        return None
    asked = [model.press_at(int(np.searchsorted(surface, node)), force) for node, force in presses]
    answer, (sizes, spreads) = model.respond(asked), model.beyond(asked)
    found = answer.displacement
    peak, own = (float(np.linalg.norm(each, axis=1).max()) for each in (right, found))
    apart = float(np.sqrt(np.mean(np.sum((found - right) ** 2, axis=1))))
    doubt = (ALONE if answer.doubt.startswith(APART) else BEYOND) if answer.doubt else BELIEVED
    others = sum(sizes) - float(np.max(sizes))
    return apart / peak, sum(sizes) / own, sum(spreads) / own, peak, others / own, doubt
