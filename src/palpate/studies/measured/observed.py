"""The evidence of a case: how its markers moved, and how they swung after the release."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import InputError
from palpate.studies.measured.experiment import Case, Experiment
from palpate.studies.measured.oscillation import Oscillation, fit_oscillation
from palpate.studies.measured.records import read_record
from palpate.studies.measured.registration import Registration, register

STILL = 0.2
"""Share of the whole way by which markers may move before they are let go."""


@dataclass(frozen=True, eq=False)
class Followed:
    """One repeat in the body's frame.

    along : (n,) [m] the mean way of the markers at ``times`` (n,) [s], in the direction in which they settle
    moves : (m, 3) [m] from the held state to the settled one; frame : how the body's frame was found
    """

    times: np.ndarray
    along: np.ndarray
    moves: np.ndarray
    frame: Registration


@dataclass(frozen=True, eq=False)
class Seen:
    """One repeat, in the body's frame.

    moves : (m, 3) [m] of the markers that are compared, from the held state to the settled one; down : (3,) the
    direction of gravity; misfit_m : of the registration [m]; swing : None if it was not looked for
    """

    moves: np.ndarray
    down: np.ndarray
    misfit_m: float
    swing: Oscillation | None


@dataclass(frozen=True, eq=False)
class Observed:
    """All repeats of a case; without files none, and ``down`` is that of the other cases."""

    repeats: list[Seen]
    down: np.ndarray

    @property
    def moves(self) -> np.ndarray | None:
        """The mean moves (m, 3) [m]; None without repeats."""
        return np.mean([seen.moves for seen in self.repeats], axis=0) if self.repeats else None

    @property
    def misfit_m(self) -> float | None:
        """The largest misfit [m] of the repeats' frames; None without repeats."""
        return max((seen.misfit_m for seen in self.repeats), default=None)


def observe_all(experiment: Experiment) -> dict[str, Observed]:
    """Read and evaluate the files of all cases, by name; InputError as ``follow`` and ``fit_oscillation``."""
    seen = {case.name: [_see(file, experiment, case.swings) for file in case.files] for case in experiment.cases}
    downs = [repeat.down for repeats in seen.values() for repeat in repeats]
    common = _unit(np.mean(downs, axis=0)) if downs else _unit(experiment.down)
    return {
        name: Observed(repeats, _unit(np.mean([r.down for r in repeats], axis=0)) if repeats else common)
        for name, repeats in seen.items()
    }


def follow(file: str, experiment: Experiment) -> Followed:
    """Read a file, register it by all markers of its held state, and follow those that are compared.

    Raises InputError if the file is no record of the markers, if these do not fit their places at rest, and if they
    move before the release.
    """
    record = read_record(file, [marker.name for marker in experiment.markers])
    begin, end = float(record.times[0]), float(record.times[-1])
    if not end - begin > experiment.held_s + experiment.settled_s:
        raise InputError(f"{file} lasts {end - begin:g} s, less than held_s and settled_s together; shorten them.")
    held = record.mean(begin, begin + experiment.held_s)
    frame = register(held, np.array([marker.at_m for marker in experiment.markers]), file)
    compared = [i for i, marker in enumerate(experiment.markers) if not marker.fixed]
    before = frame.apply(held[compared])
    moves = frame.apply(record.mean(end - experiment.settled_s, end)[compared]) - before
    way = moves.mean(axis=0)
    along = (frame.apply(record.places[:, compared]) - before).mean(axis=1) @ _unit(way)
    whole, restless = float(np.linalg.norm(way)), float(np.ptp(along[record.times <= begin + experiment.held_s + 1e-9]))
    if not restless <= STILL * whole:
        raise InputError(
            f"{file}: markers move by {restless:.3g} m within held_s, of {whole:.3g} m in all; "
            "shorten held_s to the time before the release."
        )
    return Followed(record.times, along, moves, frame)


def check_down(found: Followed, case: Case, experiment: Experiment, file: str) -> None:
    """Raise InputError if the markers rise against ``down`` in a case without a force that might lift them."""
    way = float(found.moves.mean(axis=0) @ (found.frame.rotation @ _unit(experiment.down)))
    if way < 0.0 and all(weight.force_n is None for weight in case.weights):
        raise InputError(
            f"{file}: the markers rise by {-way:.3g} m against down, {experiment.down.tolist()}, of "
            f"measured.experiments.{experiment.name}; give the direction of gravity in the frame of the files."
        )


def _see(file: str, experiment: Experiment, swings: bool) -> Seen:
    found = follow(file, experiment)
    first = int(np.argmax(found.along))  # the far end of the first swing
    swing = fit_oscillation(found.times[first:], found.along[first:], file) if swings else None
    return Seen(found.moves, found.frame.rotation @ _unit(experiment.down), found.frame.misfit_m, swing)


def _unit(vector: np.ndarray) -> np.ndarray:
    return np.asarray(vector, dtype=float) / np.linalg.norm(vector)
