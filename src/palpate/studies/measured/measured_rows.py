"""Compare what a model predicts of a case with what was measured."""

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np

from palpate.studies.measured.experiment import Experiment
from palpate.studies.measured.observed import Observed
from palpate.studies.measured.oscillation import Oscillation

ALL = "all"
"""The name of the mean over markers."""
Row = dict[str, Any]


def axis_down(down: np.ndarray) -> np.ndarray:
    """Return the axis (3,) of the body that is nearest to ``down`` (3,): along it markers sink."""
    axis = np.zeros(3)
    axis[np.argmax(np.abs(down))] = np.sign(down[np.argmax(np.abs(down))])
    return axis


def compare_moves(experiment: Experiment, seen: Observed, moves: np.ndarray | None) -> Iterator[Row]:
    """Yield how far markers sink, each and on average, and how far they move as vectors (RMS over markers).

    moves : (m, 3) [m] as predicted, or None if there is no prediction. Of vectors the error is that of their
    difference, and cannot be negative.
    """
    axis, names = axis_down(seen.down), [marker.name for marker in experiment.compared]
    found = [repeat.moves for repeat in seen.repeats]
    sinks = [each @ axis for each in found]
    sunk = None if moves is None else moves @ axis
    yield _row("sink_m", ALL, [float(s.mean()) for s in sinks], None if sunk is None else float(sunk.mean()))
    for i, name in enumerate(names):
        yield _row("sink_m", name, [float(s[i]) for s in sinks], None if sunk is None else float(sunk[i]))
    measured = None if seen.moves is None else _rms(seen.moves)
    repeat = max((_rms(a - b) for a, b in combinations(found, 2)), default=None)
    wrong = None if measured is None or moves is None else _rms(moves - seen.moves) / measured
    predicted = None if moves is None else _rms(moves)
    yield {"quantity": "move_m", "marker": ALL, "measured": measured, "repeat": repeat} | {
        "predicted": predicted, "error": wrong,
    }  # fmt: skip


def compare_swing(seen: Observed, swing: dict[str, float | None]) -> Iterator[Row]:
    """Yield rows of the quantities of an Oscillation that ``swing`` predicts, by their names; None if it failed."""
    swings: list[Oscillation] = [repeat.swing for repeat in seen.repeats if repeat.swing is not None]
    for quantity, predicted in swing.items():
        yield _row(quantity, ALL, [float(getattr(each, quantity)) for each in swings], predicted)


def _row(quantity: str, marker: str, repeats: list[float], predicted: float | None) -> Row:
    """Return the mean of ``repeats``, the widest difference between two, and the relative error of ``predicted``."""
    measured = float(np.mean(repeats)) if repeats else None
    repeat = float(np.ptp(repeats)) if len(repeats) > 1 else None
    error = None if measured is None or predicted is None else predicted / measured - 1.0
    return {"quantity": quantity, "marker": marker, "measured": measured, "repeat": repeat} | {
        "predicted": predicted, "error": error,
    }  # fmt: skip


def _rms(vectors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=-1))))
