"""What was measured: records of markers, their registration, displacements and oscillations; presses of an entry."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from palpate.bodies.mesh import unit
from palpate.effects.instrument import Instrument
from palpate.errors import InputError
from palpate.identification.presses import PressRecords, join, read_presses

if TYPE_CHECKING:
    from palpate.studies.measured.settings import ExperimentSettings, Presses


def presses_of(entry: "Presses", folder: Path = Path()) -> PressRecords:
    """Read all presses of an entry from its files, which are relative to ``folder``; InputError as ``read_presses``."""
    instrument = Instrument(**dict(entry.instrument)) if entry.instrument else None
    size = entry.thickness_m[1] if entry.thickness_m else None
    asked = entry.columns, entry.names, entry.leave_out
    return join([read_presses(folder / file, instrument, *asked, size_m=size) for file in entry.files])


def compared(experiment: "ExperimentSettings") -> dict[str, list[float]]:
    """Return the places at rest [m] of the markers that move, by name."""
    return {name: marker.at_m for name, marker in experiment.markers.items() if not marker.fixed}


def swinging(experiment: "ExperimentSettings") -> list[str]:
    """Return the names of the cases in which a frequency is seen."""
    return [name for name, case in experiment.cases.items() if case.swings]


GAPS = 0.1
"""Largest fraction of the times at which a marker may be hidden; its places are interpolated there."""


def read_record(path: str | Path, markers: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return times (n,) [s] and the places (n, m, 3) [m] of m markers there, in the frame of the file.

    They are columns ``time_s`` and ``<marker>_x_m``, ``_y_m`` and ``_z_m`` of each marker; others are ignored. Empty
    cells are places where a marker was hidden, and are interpolated. Raises InputError, naming file, column and remedy,
    if a column is missing or no number, if times do not increase, or if more than GAPS of a marker are empty.
    """
    try:
        table = pd.read_csv(path)
    except (OSError, pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is no table ({' '.join(str(error).split())}); give a CSV file.") from error
    wanted = ["time_s", *(f"{marker}_{axis}_m" for marker in markers for axis in "xyz")]
    for column in wanted:
        if column not in table:
            raise InputError(
                f"{path} lacks the column {column}; give time_s and, for each marker of the entry, "
                "its name and _x_m, _y_m and _z_m."
            )
        if not pd.api.types.is_numeric_dtype(table[column]):
            raise InputError(f"{path} has a cell in the column {column} that is no number; correct it.")
    values = table[wanted].to_numpy(dtype=float)
    times = values[:, 0]
    if len(times) < 2 or not (np.diff(times) > 0.0).all():
        raise InputError(f"{path} has times that do not increase, or fewer than two; sort its rows by time_s.")
    for name, column in zip(wanted[1:], values.T[1:], strict=True):
        visible = np.isfinite(column)
        if not visible.mean() >= 1.0 - GAPS:
            empty = f"{path}: {name} is empty in {1 - visible.mean():.0%} of the rows"
            raise InputError(f"{empty}; leave out the marker, or fill it.")
        column[~visible] = np.interp(times[~visible], times[visible], column[visible])
    return times, values[:, 1:].reshape(len(times), len(markers), 3)


MISFIT = 0.2
"""Misfit over the mean distance of the markers from their middle above which they are not those of the entry."""


@dataclass(frozen=True, eq=False)
class Registration:
    """A rigid motion x → rotation x + shift, (3, 3) and (3,) [m]; ``misfit_m``: RMS distance that is left [m]."""

    rotation: np.ndarray
    shift: np.ndarray
    misfit_m: float

    def apply(self, places: np.ndarray) -> np.ndarray:
        """Move ``places`` (…, 3) [m] into the body's frame."""
        return places @ self.rotation.T + self.shift


def register(seen: np.ndarray, rest: np.ndarray, place: str) -> Registration:
    """Fit the markers ``seen`` (m, 3) [m] to their places at ``rest`` (m, 3) [m] in the body's frame (Kabsch 1976).

    Raises InputError, naming ``place``, for fewer than three markers or markers on one line, and if they do not fit:
    other units, a left-handed frame, or markers that are confused.
    """
    seen_middle, rest_middle = seen.mean(axis=0), rest.mean(axis=0)
    spread = np.linalg.svd(rest - rest_middle, compute_uv=False)
    if len(rest) < 3 or not spread[1] > 1e-3 * spread[0]:
        raise InputError(f"{place} needs three markers that are not on one line, to find the body's frame; add one.")
    left, _, right = np.linalg.svd((rest - rest_middle).T @ (seen - seen_middle))
    rotation = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    shift = rest_middle - rotation @ seen_middle
    distances = np.linalg.norm(seen @ rotation.T + shift - rest, axis=1)
    misfit, size = float(np.sqrt(np.mean(distances**2))), float(np.linalg.norm(rest - rest_middle, axis=1).mean())
    if not misfit <= MISFIT * size:
        raise InputError(
            f"{place}: the markers before the release are {misfit:.3g} m (RMS) from their places at rest, which are "
            f"{size:.3g} m apart; see whether both are in metres, in right-handed frames, and in the same order."
        )
    return Registration(rotation, shift, misfit)


CREEP_S = 0.5
"""Start [s] of the search for the time constant of creep, or a quarter of the record if that is less."""


@dataclass(frozen=True)
class Oscillation:
    """y = rest + creep e^(−t/τ) + A e^(−ζωt) cos(ω √(1 − ζ²) t + φ).

    frequency_hz : ω / 2π, of the same body without damping [Hz]; damping_ratio : ζ
    creep_m : creep [m] from the release, half a period before the first time, to rest; creep_s : its time constant τ
    """

    frequency_hz: float
    damping_ratio: float
    creep_m: float
    creep_s: float


def swing_of(times: np.ndarray, along: np.ndarray, place: str, creeps: bool = True) -> Oscillation:
    """Fit an oscillation to the mean displacement ``along`` (n,) [m] of markers, from its largest value on."""
    peak = int(np.argmax(along))
    return fit_oscillation(times[peak:], along[peak:], place, creeps)


def fit_oscillation(times: np.ndarray, y: np.ndarray, place: str, creeps: bool = True) -> Oscillation:
    """Fit a damped oscillation to ``y`` (n,) [m] at ``times`` (n,) [s], by least squares.

    Unknowns that enter linearly are eliminated (Golub and Pereyra 1973); the search starts from the best of many
    frequencies. creeps : whether the term of creep is fitted
    Raises InputError, naming ``place``, for too few times and where no oscillation is seen.
    """
    t, duration = times - times[0], float(times[-1] - times[0])
    if len(t) < 12:
        raise InputError(f"{place} has {len(t)} rows after the release, too few for a frequency; set swings: false.")
    creep = min(CREEP_S, duration / 4)

    def residual(unknowns: np.ndarray) -> np.ndarray:
        basis = _basis(t, unknowns, creeps)
        return basis @ np.linalg.lstsq(basis, y, rcond=None)[0] - y

    # frequencies from one swing in the record up to a quarter of the sampling rate
    highest = 0.25 / float(np.median(np.diff(t)))
    starts = [np.array([f, 0.03, creep]) for f in np.arange(1.0, highest * duration, 0.25) / duration]
    start = min(starts, key=lambda unknowns: float(np.sum(residual(unknowns) ** 2)))
    lower, upper = [0.5 * start[0], 0.0, creep / 4], [2.0 * start[0], 0.9, 4 * creep]
    scale = [0.1 * start[0], 0.01, 0.3 * creep]
    result = least_squares(residual, start, bounds=(lower, upper), x_scale=scale, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    basis = _basis(t, result.x, creeps)
    factors = np.linalg.lstsq(basis, y, rcond=None)[0]
    misfit, amplitude = np.sqrt(np.mean(result.fun**2)), np.hypot(*factors[1:3])
    if not misfit < 0.5 * amplitude:
        raise InputError(f"{place} shows no damped oscillation after the release; set swings: false for it.")
    frequency, ratio, constant = map(float, result.x)
    crept = -float(factors[3] * np.exp(0.5 / (frequency * constant))) if creeps else 0.0
    return Oscillation(frequency, ratio, crept, constant)


def _basis(t: np.ndarray, unknowns: np.ndarray, creeps: bool) -> np.ndarray:
    """Return the terms (n, 3 or 4) that y is a linear combination of: rest, both phases of the oscillation, and creep.

    unknowns : frequency [Hz], damping ratio, time constant of the creep [s]
    """
    frequency, ratio, creep = unknowns
    omega = 2 * np.pi * frequency
    fading, angle = np.exp(-ratio * omega * t), omega * np.sqrt(1.0 - ratio**2) * t
    columns = [np.ones_like(t), fading * np.cos(angle), fading * np.sin(angle)]
    return np.column_stack([*columns, np.exp(-t / creep)] if creeps else columns)


STILL = 0.2
"""Range of the markers' displacement before the release over the whole displacement, above which they are not held."""


@dataclass(frozen=True, eq=False)
class Seen:
    """What one repeat of a case measured, in the body's frame.

    along : (n,) [m] mean displacement of the markers at ``times`` (n,) [s], in the direction in which they settle
    moves : (m, 3) [m] displacements of the compared markers from the held state to rest, less the mean one of the fixed
    down : (3,) direction of gravity; misfit_m : of the registration [m]; swing : None if none was fitted
    """

    times: np.ndarray
    along: np.ndarray
    moves: np.ndarray
    down: np.ndarray
    misfit_m: float
    swing: Oscillation | None = None


@dataclass(frozen=True, eq=False)
class Observed:
    """All repeats of a case, and the direction of gravity ``down`` (3,), without repeats that of the other cases."""

    repeats: list[Seen]
    down: np.ndarray

    @property
    def moves(self) -> np.ndarray | None:
        """The mean moves (m, 3) [m]; None without repeats."""
        return np.mean([seen.moves for seen in self.repeats], axis=0) if self.repeats else None

    @property
    def axis(self) -> np.ndarray:
        """The coordinate axis (3,) of the body nearest to ``down``, along which markers sink."""
        axis, nearest = np.zeros(3), np.argmax(np.abs(self.down))
        axis[nearest] = np.sign(self.down[nearest])
        return axis

    @property
    def sink_m(self) -> float:
        """How far the markers sank on average [m], in a case with files."""
        assert self.moves is not None
        return float((self.moves @ self.axis).mean())

    @property
    def swings(self) -> list[Oscillation]:
        """The oscillations of the repeats to which one was fitted."""
        return [seen.swing for seen in self.repeats if seen.swing is not None]

    @property
    def creep_m(self) -> float:
        """The mean creep [m]; 0 if none is seen."""
        return float(np.mean([swing.creep_m for swing in self.swings])) if self.swings else 0.0

    @property
    def uncertainty_m(self) -> float:
        """The standard uncertainty [m] of how far markers sink: the misfit in one direction.

        The model starts from the shape at rest, and markers of the held body are off their places by the misfit. It is
        the same for all markers and repeats, as the body was held once, so that means over them are as uncertain.
        """
        return (self.misfit_m or 0.0) / np.sqrt(3.0)

    @property
    def misfit_m(self) -> float | None:
        """The largest misfit [m] of the repeats' frames; None without repeats."""
        return max((seen.misfit_m for seen in self.repeats), default=None)


def observe_all(experiment: "ExperimentSettings") -> dict[str, Observed]:
    """Read and evaluate the files of all cases, by name; InputError as ``follow`` and ``fit_oscillation``."""
    seen: dict[str, list[Seen]] = {}
    for name, case in experiment.cases.items():
        repeats = [follow(file, experiment) for file in case.files]
        if case.swings:
            fits = [swing_of(each.times, each.along, file) for each, file in zip(repeats, case.files, strict=True)]
            repeats = [replace(each, swing=swing) for each, swing in zip(repeats, fits, strict=True)]
        seen[name] = repeats
    downs = [repeat.down for repeats in seen.values() for repeat in repeats]
    common = unit(np.mean(downs, axis=0) if downs else np.array(experiment.down, dtype=float))
    return {
        name: Observed(repeats, unit(np.mean([r.down for r in repeats], axis=0)) if repeats else common)
        for name, repeats in seen.items()
    }


def follow(file: str, experiment: "ExperimentSettings") -> Seen:
    """Read a file, register it by all markers of its held state, and compute the motion of the compared markers.

    The mean displacement of the fixed markers is subtracted, as a clamp gives way; its rotation, which three markers
    side by side hardly show, is not.
    Raises InputError if the file is no record of the markers, or these do not fit their places or move when held.
    """
    markers = list(experiment.markers.values())
    times, places = read_record(file, list(experiment.markers))
    begin, end = float(times[0]), float(times[-1])
    if not end - begin > experiment.held_s + experiment.settled_s:
        raise InputError(f"{file} lasts {end - begin:g} s, less than held_s and settled_s together; shorten them.")
    is_held = times <= begin + experiment.held_s + 1e-9
    is_settled = times >= end - experiment.settled_s - 1e-9
    held = places[is_held].mean(axis=0)
    frame = register(held, np.array([marker.at_m for marker in markers], dtype=float), file)
    fixed = np.array([marker.fixed for marker in markers])
    held_places = frame.apply(held[~fixed])
    all_moves = frame.apply(places[is_settled].mean(axis=0)) - frame.apply(held)
    moves = all_moves[~fixed] - (all_moves[fixed].mean(axis=0) if fixed.any() else 0.0)
    mean_move = moves.mean(axis=0)
    along = (frame.apply(places[:, ~fixed]) - held_places).mean(axis=1) @ unit(mean_move)
    whole_move, while_held = np.linalg.norm(mean_move), np.ptp(along[is_held])
    if not while_held <= STILL * whole_move:
        raise InputError(
            f"{file}: markers move by {while_held:.3g} m within held_s, of {whole_move:.3g} m in all; "
            "shorten held_s to the time before the release."
        )
    return Seen(times, along, moves, frame.rotation @ unit(np.array(experiment.down, dtype=float)), frame.misfit_m)
