"""Check that loads and markers are where the body is: places in another frame or unit are refused, not moved to it."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.body import Body
from palpate.errors import InputError
from palpate.studies.measured.experiment import Experiment, Weight

ON, NEAR, WIDE, SHORT = 0.01, 0.2, 0.5, 0.01
"""Shares of the body's size: how far a load may be from the surface and a marker may stand off it, how wide a disc may
be, and how long a line is at least."""
POINTS = 21
"""Points of a line that are looked at."""

Away = Callable[[np.ndarray], np.ndarray]
"""The distances (k,) [m] of points (k, 3) [m] from a body's surface."""


def off_box(sizes_m: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Compute how far ``points`` (k, 3) [m] are, (k,) [m], from the surface of the box from 0 to ``sizes_m`` (3,)."""
    beyond = np.maximum(-points, points - sizes_m)
    return np.where((beyond > 0.0).any(axis=1), np.linalg.norm(np.maximum(beyond, 0.0), axis=1), -beyond.max(axis=1))


def check_places(experiment: Experiment, body: Body, away: Away) -> None:
    """Raise InputError for loads off the surface of ``body`` or on what is held, and for markers far from it.

    Discs wider than half of the body and lines of no length are refused, too; the message names the body's box.
    """
    place, nodes = f"measured.experiments.{experiment.name}", body.fine.nodes
    box = f"{body.name}, which reaches from {_words(nodes.min(axis=0))} to {_words(nodes.max(axis=0))} m"
    for marker in experiment.markers:
        off = float(away(marker.at_m[None])[0])
        if off > NEAR * body.fine.size:
            raise InputError(
                f"{place}.markers.{marker.name}.at_m is {off:.3g} m off the surface of {box}; "
                "give its place at rest in that frame, in metres."
            )
    for case in experiment.cases:
        for number, weight in enumerate(case.weights):
            _check_load(f"{place}.cases.{case.name}.loads[{number}]", weight, body, away, box)


def _check_load(place: str, weight: Weight, body: Body, away: Away, box: str) -> None:
    """Raise InputError for one load, named ``place``."""
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
