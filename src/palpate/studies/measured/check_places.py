"""The check that the loads and markers of an experiment are on its body."""

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.body import Body
from palpate.effects.patch_load import nearest_on_surface
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.studies.measured.settings import ExperimentSettings, Load

ON, NEAR_SURFACE, WIDE, SHORT = 0.01, 0.2, 0.5, 0.01
"""Limits over the body's size: the distance of a load and of a marker from the surface, the radius of a disc, and the
least length of a line."""
POINTS = 21
"""Points of a line whose distance from the surface is checked."""


def check_places(name: str, experiment: "ExperimentSettings", body: Body) -> None:
    """Raise InputError for loads off the surface of ``body`` or on held nodes, and for markers far from the surface.

    Discs wider than half of the body and lines of no length are refused, too.
    name : of the experiment
    """
    place, nodes = f"measured.experiments.{name}", body.fine.nodes
    box = f"{body.name}, which reaches from {_words(nodes.min(axis=0))} to {_words(nodes.max(axis=0))} m"
    for key, marker in experiment.markers.items():
        distance_m = float(nearest_on_surface(body.fine, np.array([marker.at_m], dtype=float))[2][0])
        if distance_m > NEAR_SURFACE * body.fine.size:
            raise InputError(
                f"{place}.markers.{key}.at_m is {distance_m:.3g} m off the surface of {box}; "
                "give its place at rest in that frame, in metres."
            )
    for key, case in experiment.cases.items():
        for number, load in enumerate(case.loads):
            _check_load(f"{place}.cases.{key}.loads[{number}]", load, body, box)


def _check_load(place: str, load: "Load", body: Body, box: str) -> None:
    """Raise InputError, naming ``place``, for a load that is off the surface, too wide or short, or on held nodes."""
    size, key = body.fine.size, "at_m" if load.line_m is None else "line_m"
    ends = np.array([load.at_m, load.at_m] if load.line_m is None else load.line_m, dtype=float)
    points = np.linspace(ends[0], ends[1], POINTS)
    if load.line_m is not None and not np.linalg.norm(ends[1] - ends[0]) > SHORT * size:
        raise InputError(f"{place}.line_m is as short as a point; give two ends, or at_m with radius_m.")
    if load.radius_m > WIDE * size:
        raise InputError(f"{place}.radius_m is {load.radius_m:g} m, more than half of {box}; give it in metres.")
    apart_m = float(nearest_on_surface(body.fine, points)[2].max())
    if apart_m > ON * size:
        raise InputError(
            f"{place}.{key} is {apart_m:.3g} m off the surface of {box}; give a place on it in that frame, in metres."
        )
    surface = body.fine.surface
    nearest = surface[cKDTree(body.fine.nodes[surface]).query(points)[1]]
    if np.isin(nearest, body.anchors[-1]).mean() > 0.5:
        raise InputError(f"{place}.{key} is where {box}, is held, and moves nothing; give a place in that frame.")


def _words(point: np.ndarray) -> str:
    return f"[{', '.join(f'{value:.3g}' for value in point)}]"
