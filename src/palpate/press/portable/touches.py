"""Prepare places that rigid instruments press in a portable file, and measure how wrong the file is there.

A place is a reduced model of ``palpate.models.touch``. Its error is that of the file against quadratic elements of the
same mesh, in pushes between those that it is made of.
"""

import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.benchmark.touch import Touch, TouchCase, places_to_touch
from palpate.benchmark.touch_mesh import TouchedMeshes, answer_of
from palpate.bodies.body import Body
from palpate.bodies.contacts import spread_over
from palpate.effects.instrument import SPHERE, Instrument, upright
from palpate.errors import InputError, NotConverged
from palpate.models.touch.modes import TouchModes
from palpate.models.touch.reduced_touch import RIDGE, tilted, tilted_ways
from palpate.press.portable.runtimes.palpate_model import (
    KINDS,
    TILTED,
    PortableModel,
    TouchPlace,
    settle_touch,
    touch_kernel,
)

LOWER, FALLS = 0.7, 3
"""Factor by which the depth is lowered at a place that gives way, and how often before the place is left out."""
TILTS, TURNS, SHARES = (22.5, 45.0), 8, (0.35, 0.7, 1.0)
"""Angles [degrees], directions and depths over the deepest at which searches of the file begin."""
HELD = 2
"""Level to which meshes of places are refined at the rim of held nodes."""
TRIED = ((0.0, 0.0, (0.4, 0.9)), (TILTED, 22.5, (0.55, 0.85)))
"""Tilts and turns [degrees] and depths over the deepest at which the file is compared with elements."""
PUSH_TOLERANCE = 1e-4
MOST_ERROR, MOST_FORCE_ERROR = 0.1, 0.25
"""Errors of the displacement over its peak and of the force, above which a place is left: the body gives way there in
some pushes, and not in those that the place is made of."""
FLAT = 0.75
"""Least cosine between the normal of a place and those within twice the instrument's radius of it."""


@dataclass(frozen=True)
class Touches:
    """What a file is to hold: ``instruments``, each at so many ``places``, ``depth_of_radius`` deep at most.

    level : that meshes are refined to where they are touched
    """

    instruments: Sequence[Instrument]
    places: int
    depth_of_radius: float = 0.75
    level: int = 3


@dataclass(frozen=True, eq=False)
class _Trial:
    """A touch of place number ``place`` that elements answer."""

    place: int
    touch: Touch
    displacement: np.ndarray
    force_n: float


def prepare_places(
    body: Body, asked: Touches, seed: int, progress: Callable[[Sequence], Iterable] = iter
) -> tuple[list[TouchPlace], list[_Trial]]:
    """Prepare the places of ``body`` at which instruments press, and trials to measure their errors by.

    InputError for instruments that a file cannot hold; warns of places that bear no touch.
    """
    places: list[TouchPlace] = []
    trials: list[_Trial] = []
    for instrument in asked.instruments:
        _refuse(instrument, asked.depth_of_radius)
    pairs = [(tool, node) for tool in asked.instruments for node in _nodes(body, tool, asked.places)]
    left_out = 0
    for instrument, node in progress(pairs):
        for lowered in range(FALLS):
            deepest = asked.depth_of_radius * instrument.radius_m * LOWER**lowered
            try:
                case = TouchCase(body, instrument, deepest, seed)
                place, trials_there = _place(case, asked.level, node, len(places))
            except (NotConverged, InputError):
                continue
            places.append(place)
            trials += trials_there
            break
        else:
            left_out += 1
    if left_out:
        warnings.warn(
            f"bodies.{body.name}: {left_out} of {len(pairs)} places to touch give way, and are left.", stacklevel=2
        )
    return places, trials


def measured(model: PortableModel, places: Sequence[TouchPlace], trials: Sequence[_Trial]) -> list[TouchPlace]:
    """Return ``places`` with their errors, the largest of the ``trials`` there; model : the file that holds them.

    Straight pushes and tilted ones have errors of their own, as modes of few directions answer others less well. Warns
    of places whose errors are above MOST_ERROR or MOST_FORCE_ERROR, which are left out.
    """
    accurate = []
    for number, place in enumerate(places):
        errors: dict[bool, list[tuple[float, float]]] = {True: [], False: []}
        for trial in trials:
            if trial.place == number:
                answer = model.touch(number, trial.touch.depth_m, trial.touch.direction)
                rmse = np.sqrt(np.mean(np.sum((answer.displacement - trial.displacement) ** 2, axis=1)))
                peak_m = np.linalg.norm(trial.displacement, axis=1).max()
                straight = float(trial.touch.direction @ place.axes[2]) < -1.0 + 1e-9
                errors[straight].append((rmse / peak_m, abs(answer.force_n / trial.force_n - 1.0)))
        (error, force_error), (tilted, tilted_force) = (np.max(errors[straight], axis=0) for straight in (True, False))
        if max(error, tilted) <= MOST_ERROR and max(force_error, tilted_force) <= MOST_FORCE_ERROR:
            errors_of: dict[str, Any] = {"error": float(error), "force_error": float(force_error)}
            accurate.append(
                replace(place, **errors_of, tilted_error=float(tilted), tilted_force_error=float(tilted_force))
            )
    if out := len(places) - len(accurate):
        warnings.warn(f"{out} of {len(places)} places to touch are answered too wrongly, and are left.", stacklevel=2)
    return accurate


def _refuse(instrument: Instrument, depth_of_radius: float) -> None:
    """Raise InputError for an instrument that a file cannot hold."""
    if instrument.kind not in KINDS or instrument.sticks:
        raise InputError(f"a portable model cannot hold the {instrument.name}; take a sphere or a punch that slides.")
    if instrument.kind == SPHERE and depth_of_radius >= 1.0:
        raise InputError(
            f"{instrument.name}: {depth_of_radius:g} radii is deeper than half the ball; give less than 1."
        )


def _nodes(body: Body, instrument: Instrument, count: int) -> list[int]:
    """Return ``count`` nodes that can be touched, spread over those where the surface is flat beside the instrument."""
    candidates, surface = places_to_touch(body), body.fine.surface
    points, normals = body.fine.nodes[surface], body.fine.normals
    least_cosines = []
    for node in candidates:
        nearby = surface[np.linalg.norm(points - body.fine.nodes[node], axis=1) < 2.0 * instrument.radius_m]
        least_cosines.append(float((normals[nearby] @ normals[node]).min()) > FLAT)
    candidates = candidates[least_cosines] if any(least_cosines) else candidates
    return [int(candidates[row]) for row in spread_over(body.fine.nodes[candidates], count)]


def _place(case: TouchCase, level: int, node: int, number: int) -> tuple[TouchPlace, list[_Trial]]:
    """Prepare one place, without errors yet, and its trials; NotConverged where the body gives way under the touch."""
    body, instrument, deepest = case.body, case.instrument, case.deepest_m
    solver, origin = TouchModes(case, HELD, level), body.fine.nodes[node]
    axes = upright(instrument, origin, body.fine.normals[node]).axes
    straight = Touch(instrument, node, -axes[2], deepest)
    solver.prepare(straight)
    reduced = solver.reduced(node)
    directions = tilted_ways(axes, TILTS, TURNS)
    poses = [Touch(instrument, node, direction, deepest).pose(body) for direction in directions]
    x, y = (directions @ axes.T)[:, :2].T
    reaches = np.array([(pose.tip - origin) @ direction for pose, direction in zip(poses, directions, strict=True)])
    first = np.linalg.lstsq(np.column_stack([np.ones(len(x)), x, y, x * x, x * y, y * y]), reaches)[0]
    edge = instrument.radius_m if instrument.kind == SPHERE else instrument.edge_m
    slopes, volumes, mu, lam = (each[0] for each in reduced.model.body[:4])
    points, moves, areas, penalty = reduced.points
    place = TouchPlace(  # its errors are found by ``measured``
        int(np.searchsorted(body.fine.surface, node)), instrument.kind, instrument.radius_m, edge, axes, first, deepest,
        stretched=1.0, error=0.0, force_error=0.0, tilted_error=0.0, tilted_force_error=0.0, rest=reduced.model.rest,
        volumes=volumes, mu=np.broadcast_to(mu, volumes.shape), lam=np.broadcast_to(lam, volumes.shape), slopes=slopes,
        points=points, moves=moves, areas=areas, penalty=penalty, surface=reduced.surface,
        pushed=np.empty((0, 3)), starts=np.empty((0, reduced.count)),
    )  # fmt: skip
    # the search of any push begins where pushes like it have come to, interpolated by a kernel
    pushed, states, areas_m2 = [], [], []
    for pose, direction in zip(poses, directions, strict=True):
        q = np.zeros(reduced.count)
        for share in SHARES:
            q, _, area, _ = settle_touch(place, pose.tip + share * deepest * direction, q)
            pushed.append(share * axes @ direction)
            states.append(q)
            areas_m2.append(area)
    kernel = touch_kernel(np.array(pushed), np.array(pushed).T) + RIDGE * np.eye(len(pushed))
    starts, stretched = np.linalg.solve(kernel, states), solver.respond(straight).area_m2 / areas_m2[len(SHARES) - 1]
    place = replace(place, pushed=np.array(pushed), starts=starts, stretched=stretched)
    return place, _trials(case, level, node, axes, number)


def _trials(case: TouchCase, level: int, node: int, axes: np.ndarray, number: int) -> list[_Trial]:
    """Return the answers of elements of the same mesh to touches between those that a place is made of."""
    meshes = case.share("touched meshes", lambda: TouchedMeshes(case.body))
    pushes = [Touch(case.instrument, node, tilted(axes, tilt, turn), case.deepest_m) for tilt, turn, _ in TRIED]
    mesh = meshes.around_all(pushes, HELD, level)
    trials = []
    for push, (_, _, shares) in zip(pushes, TRIED, strict=True):
        mesh.contact.begin([push.pose(case.body)])
        for state in mesh.contact.push(push.direction, [share * case.deepest_m for share in shares], PUSH_TOLERANCE):
            touch = replace(push, depth_m=state.depth_m)
            answer = answer_of(mesh.problem, state, touch, mesh.up)
            trials.append(_Trial(number, touch, answer.displacement, answer.force_n))
    return trials
