"""An experiment as its entry in the config describes it, and the check that loads and markers are on the body."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.body import Body
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.studies.measured.settings import ExperimentSettings, Load

GIVEN = "no"
"""Value of the column ``calibrated`` where Young's modulus is that of the settings and fitted to no case."""


@dataclass(frozen=True, eq=False)
class Marker:
    """A marker and its position ``at_m`` (3,) [m] at rest; a ``fixed`` one is beside the body and does not move."""

    name: str
    at_m: np.ndarray
    fixed: bool


@dataclass(frozen=True, eq=False)
class Weight:
    """A force on a part of the surface: on the line between two points, or on a disc.

    force_n : (3,) [N] in the body's frame, or None for a ``weight_n`` [N] that hangs there, whose mass moves along
    line_m : (2, 3) [m], or None for the disc of ``radius_m`` [m] around ``at_m`` (3,) [m]
    """

    force_n: np.ndarray | None
    weight_n: float
    line_m: np.ndarray | None
    at_m: np.ndarray | None
    radius_m: float


@dataclass(frozen=True, eq=False)
class Case:
    """The loads on a body beside gravity, and the files of the repeated measurements, if there are any.

    swings : whether the body oscillates after the release, so that frequency and damping are compared
    """

    name: str
    weights: tuple[Weight, ...]
    files: tuple[str, ...]
    swings: bool


@dataclass(frozen=True, eq=False)
class Experiment:
    """A body that is released from its held state under gravity and loads, in several cases.

    down : (3,) direction of gravity in the frame of the files
    calibrate_on : name of the case that Young's modulus is fitted to, empty for none
    held_s, settled_s : duration [s] of the first part of each record, before the release, and of the last, at rest
    """

    name: str
    down: np.ndarray
    markers: tuple[Marker, ...]
    cases: tuple[Case, ...]
    calibrate_on: str
    held_s: float
    settled_s: float

    @property
    def fitted(self) -> Case | None:
        """The case that E is fitted to; None if it is fitted to none."""
        return next((case for case in self.cases if case.name == self.calibrate_on), None)

    @property
    def swinging(self) -> list[Case]:
        """The cases in which a frequency is seen."""
        return [case for case in self.cases if case.swings]

    @property
    def compared(self) -> list[Marker]:
        """The markers that move."""
        return [marker for marker in self.markers if not marker.fixed]


def experiment_of(name: str, entry: "ExperimentSettings") -> Experiment:
    """Make the experiment ``name`` from its settings.

    Raises InputError for what a schema cannot see: no marker that moves, ``down`` without a direction, a case to
    calibrate on that is unknown or has no files, a load without a size or a place.
    """
    place = f"measured.experiments.{name}"
    markers = tuple(Marker(m, _vector(each.at_m), each.fixed) for m, each in entry.markers.items())
    if all(marker.fixed for marker in markers):
        raise InputError(f"{place}.markers are all fixed; leave fixed out of those on what moves.")
    down = _vector(entry.down)
    if not np.linalg.norm(down) > 0.0:
        raise InputError(f"{place}.down is [0, 0, 0]; give the direction of gravity in the frame of the files.")
    cases = []
    for case, each in entry.cases.items():
        weights = tuple(_weight(f"{place}.cases.{case}.loads[{i}]", load) for i, load in enumerate(each.loads))
        cases.append(Case(case, weights, tuple(each.files), each.swings))
    on, known = entry.calibrate_on, {case.name: case for case in cases}
    if on is not None and (on not in known or not known[on].files):
        measured = ", ".join(case.name for case in cases if case.files) or "none has files"
        raise InputError(f"{place}.calibrate_on is {on}, which is no case with files; choose from {measured}, or null.")
    times = entry.held_s, entry.settled_s
    return Experiment(name, down, markers, tuple(cases), on or "", *times)


def _weight(place: str, load: "Load") -> Weight:
    if (load.force_n is None) == (load.weight_n is None):
        raise InputError(f"{place} must have either weight_n, of what hangs there, or force_n; give one of them.")
    if (load.line_m is None) == (load.at_m is None):
        raise InputError(f"{place} must have either line_m, the ends of an edge, or at_m, a point; give one of them.")
    if load.line_m is not None and load.radius_m > 0.0:
        raise InputError(f"{place} has radius_m, which belongs to at_m and not to line_m; remove one of the two.")
    force, line, at = (None if given is None else _vector(given) for given in (load.force_n, load.line_m, load.at_m))
    return Weight(force, load.weight_n or 0.0, line, at, load.radius_m)


def _vector(values: list) -> np.ndarray:
    return np.array(values, dtype=float)


ON, NEAR_SURFACE, WIDE, SHORT = 0.01, 0.2, 0.5, 0.01
"""Limits over the body's size: the distance of a load and of a marker from the surface, the radius of a disc, and the
least length of a line."""
POINTS = 21
"""Points of a line whose distance from the surface is checked."""

SurfaceDistance = Callable[[np.ndarray], np.ndarray]
"""Function from points (k, 3) [m] to their distances (k,) [m] from a body's surface."""


def off_box(sizes_m: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Compute the distances (k,) [m] of ``points`` (k, 3) [m] from the surface of a box from 0 to ``sizes_m`` (3,)."""
    beyond = np.maximum(-points, points - sizes_m)
    return np.where((beyond > 0.0).any(axis=1), np.linalg.norm(np.maximum(beyond, 0.0), axis=1), -beyond.max(axis=1))


def check_places(experiment: Experiment, body: Body, away: SurfaceDistance) -> None:
    """Raise InputError for loads off the surface of ``body`` or on held nodes, and for markers far from the surface.

    Discs wider than half of the body and lines of no length are refused, too.
    away : distance from the surface of ``body``
    """
    place, nodes = f"measured.experiments.{experiment.name}", body.fine.nodes
    box = f"{body.name}, which reaches from {_words(nodes.min(axis=0))} to {_words(nodes.max(axis=0))} m"
    for marker in experiment.markers:
        off = float(away(marker.at_m[None])[0])
        if off > NEAR_SURFACE * body.fine.size:
            raise InputError(
                f"{place}.markers.{marker.name}.at_m is {off:.3g} m off the surface of {box}; "
                "give its place at rest in that frame, in metres."
            )
    for case in experiment.cases:
        for number, weight in enumerate(case.weights):
            _check_load(f"{place}.cases.{case.name}.loads[{number}]", weight, body, away, box)


def _check_load(place: str, weight: Weight, body: Body, away: SurfaceDistance, box: str) -> None:
    """Raise InputError, naming ``place``, for a load that is off the surface, too wide or short, or on held nodes."""
    size, points = body.fine.size, _points(weight)
    key = "at_m" if weight.line_m is None else "line_m"
    if len(points) > 1 and not np.linalg.norm(points[-1] - points[0]) > SHORT * size:
        raise InputError(f"{place}.line_m is as short as a point; give two ends, or at_m with radius_m.")
    if weight.radius_m > WIDE * size:
        raise InputError(f"{place}.radius_m is {weight.radius_m:g} m, more than half of {box}; give it in metres.")
    off = float(away(points).max())
    if off > ON * size:
        raise InputError(
            f"{place}.{key} is {off:.3g} m off the surface of {box}; give a place on it in that frame, in metres."
        )
    surface = body.fine.surface
    nearest = surface[cKDTree(body.fine.nodes[surface]).query(points)[1]]
    if np.isin(nearest, body.anchors[-1]).mean() > 0.5:
        raise InputError(f"{place}.{key} is where {box}, is held, and moves nothing; give a place in that frame.")


def _points(weight: Weight) -> np.ndarray:
    """Return the points (k, 3) [m] of a line, or the middle (1, 3) of a disc."""
    if weight.line_m is not None:
        return np.linspace(weight.line_m[0], weight.line_m[1], POINTS)
    assert weight.at_m is not None  # one of the two, as experiment_of says
    return weight.at_m[None]


def _words(point: np.ndarray) -> str:
    return f"[{', '.join(f'{value:.3g}' for value in point)}]"
