"""Strokes from which modes are learnt: neighbours of a path or random ones, and how elements move under them."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.bodies.body import Body
from palpate.bodies.particles import Particles
from palpate.bodies.refinement import with_midpoints
from palpate.collision.contact.instrument_contact import instruments_of
from palpate.effects.instrument import gaps_of
from palpate.effects.settings import Ball, Capsule, Contact, Instrument, Loads, Rayleigh
from palpate.errors import InputError, NotConverged
from palpate.solvers.indentation import ContactPoints, contact_points
from palpate.solvers.touched_motion import STIFFER, TouchedMotion

STEP_S, LEAST_STEPS, TOLERANCE = 0.01, 30, 1e-2
"""Steps of the strokes that modes are learnt from, how many at least, and the tolerance of each; what they move like is
enough, and not exactly when. For the same reason contact is no stiffer than at rest, and friction that of the stage
before: that moves a stroke by 0.05 % of its peak."""
MARGIN, PLACES = 1.2, 60
"""Distance of an instrument's skin on its path from points at rest, over its radius, within which it may touch them,
and at how many places of the path that is seen."""
LEAST_SHARE = 0.5
"""Least share of the strokes whose motion is found; others lead into what is held."""
BESIDE = ((0.0, 0.6, 0.3), (0.0, -0.6, 0.3), (0.6, 0.0, -0.2), (-0.6, 0.0, 0.4), (0.0, 0.0, 0.8))
"""How far a path's neighbours are from it, over an instrument's radius: two ways across the way down, and up."""
TIMES_S = (0.0, 0.22, 0.27, 0.45, 0.58)
"""Of a random stroke: it begins, is pressed in, starts to slide, ends to, and is lifted off."""
LENGTH_M, DEPTHS_M = 0.035, (0.008, 0.02)
DURATION_S = 0.6
CLEAR_M, WITHIN_M = 0.003, 0.012
"""Height of an instrument's start above all below it; the surface is as high as its highest node within the other."""


def frame_of(contact: Contact) -> np.ndarray:
    """Return directions (3, 3), as rows: two across the way in which the first moving instrument starts, and up."""
    for tool in contact.instruments:
        moves = np.diff(np.array(tool.shifts_m or [], dtype=float).reshape(-1, 3), axis=0)
        moves = moves[np.linalg.norm(moves, axis=1) > 0.0]
        if len(moves):
            up = -moves[0] / np.linalg.norm(moves[0])
            side = np.eye(3)[np.argmin(np.abs(up))]
            along = side - (side @ up) * up
            along /= np.linalg.norm(along)
            return np.array([along, np.cross(up, along), up])
    raise InputError("no instrument moves, so there is no stroke to learn modes from; choose backward_euler.")


def neighbours(contact: Contact) -> list[Contact]:
    """Return contacts whose instruments move beside those of ``contact``, by the offsets BESIDE."""
    frame = frame_of(contact)

    def moved(tool: Instrument, beside: tuple[float, ...]) -> Instrument:
        if not tool.shifts_m:
            return tool
        shift = getattr(tool, "radius_m", 0.0) * np.array(beside) @ frame
        return tool.but(shifts_m=(np.array(tool.shifts_m, dtype=float) + shift).tolist())

    return [contact.but(instruments=[moved(tool, beside) for tool in contact.instruments]) for beside in BESIDE]


def roaming(particles: Particles, contact: Contact, half_width_m: float, count: int, seed: int) -> list[Contact]:
    """Return ``count`` random strokes of the moving instrument of ``contact``: pressed in, slid straight on, lifted.

    They are in the square of ``half_width_m`` [m] to each side around the middle of its path, turned by any angle.
    InputError if there is no surface below enough of the square.
    """
    frame = frame_of(contact)
    moving = next(k for k, tool in enumerate(contact.instruments) if tool.shifts_m)
    tool, rng = contact.instruments[moving], np.random.default_rng(seed)
    points, radius = np.array(_places(tool), dtype=float), getattr(tool, "radius_m", 0.0)
    offsets = points - points.mean(axis=0)
    region_middle = (points.mean(axis=0) + np.array(tool.shifts_m, dtype=float).mean(axis=0)) @ frame.T
    reach = max(WITHIN_M, float(np.linalg.norm(offsets, axis=1).max()) + radius)
    surface = particles.nodes[np.unique(particles.triangles)] @ frame.T
    strokes: list[Contact] = []
    for _ in range(100 * count):  # draws; those off the surface or the square are left out
        x, y = region_middle[:2] + rng.uniform(-half_width_m, half_width_m, 2)
        heading, turn, depth = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, np.pi), rng.uniform(*DEPTHS_M)
        ends = np.array([[x, y], [x + LENGTH_M * np.cos(heading), y + LENGTH_M * np.sin(heading)]])
        heights = [_height(surface, end, WITHIN_M) for end in ends]
        if np.abs(ends - region_middle[:2]).max() > half_width_m or min(heights) == -np.inf:
            continue
        top, slide = max(_height(surface, end, reach) for end in ends) + radius + CLEAR_M, ends[1] - ends[0]
        down, down_end = (height + radius - depth - top for height in heights)
        shifts = np.array([[0, 0, 0], [0, 0, down], [0, 0, down], [*slide, down_end], [*slide, 0]], dtype=float) @ frame
        start = np.array([x, y, top]) @ frame
        turned = start + Rotation.from_rotvec(-turn * frame[2]).apply(offsets)
        places = dict(zip(["center_m"] if isinstance(tool, Ball) else ["from_m", "to_m"], turned.tolist(), strict=True))
        stroke = list(contact.instruments)
        stroke[moving] = tool.but(**places, times_s=list(TIMES_S), shifts_m=shifts.tolist())
        strokes.append(contact.but(instruments=stroke))
        if len(strokes) == count:
            return strokes
    raise InputError(f"{particles.name} has no surface below most of the region; give another path or a smaller one.")


def _places(tool: Instrument) -> list:
    """Return the centre of a sphere or the ends of a capsule; InputError for other instruments."""
    if isinstance(tool, Ball):
        return [tool.center_m]
    if isinstance(tool, Capsule):
        return [tool.from_m, tool.to_m]
    raise InputError(f"a region is learnt for spheres and capsules, and the scene has a {tool.kind}.")


def _height(surface: np.ndarray, at: np.ndarray, within_m: float) -> float:
    """Return the height [m] of the ``surface`` (n, 3) within ``within_m`` of ``at`` (2,), −∞ where there is none."""
    near = np.hypot(*(surface[:, :2] - at).T) < within_m
    return float(surface[near, 2].max()) if near.any() else -np.inf


def whole_of(body: Body) -> Body:
    """Return ``body`` with one more level: the nodes of quadratic elements on its finest."""
    return with_midpoints(replace(body, smooth=None), len(body.levels) - 1)


def points_of(body: Body, contacts: Sequence[Contact]) -> ContactPoints:
    """Return the contact points of quadratic elements within MARGIN times an instrument's radius of its path.

    InputError where there are none.
    """

    def near(places: np.ndarray) -> np.ndarray:
        close = np.zeros(len(places), dtype=bool)
        for contact in contacts:
            tools = instruments_of(body, contact)
            stops = [float(tool.times_s[-1]) for tool in contact.instruments if tool.times_s]
            for t in np.linspace(0.0, max(stops, default=0.0), PLACES):
                posed = tools.at(t)
                close |= (gaps_of(places, posed)[0] < MARGIN * posed.radii[:, None]).any(axis=0)
        return close

    try:
        return contact_points(body.fine, 2, body.material.young_pa, near)
    except NotConverged as error:
        raise InputError(
            f"no instrument comes within {MARGIN:g} times its radius of {body.name}; lead its path there."
        ) from error


def elements_under(body: Body, contact: Contact, rayleigh: Rayleigh, points: ContactPoints) -> TouchedMotion:
    """Return the motion of quadratic elements on the finest level, whose ``points`` a contact's instruments touch."""
    return TouchedMotion(whole_of(body), len(body.levels) - 1, Loads(), rayleigh, points, instruments_of(body, contact))


def shown(
    body: Body, contacts: Sequence[Contact], rayleigh: Rayleigh, duration_s: float, progress: Callable = iter
) -> np.ndarray:
    """Return displacements (s, n, 3) [m] of quadratic elements at the ends of all steps of strokes by ``contacts``.

    A stroke whose motion is not found is left out; NotConverged if fewer than LEAST_SHARE are found.
    """
    points, steps = points_of(body, contacts), max(LEAST_STEPS, round(duration_s / STEP_S))
    points, states = replace(points, penalty=points.penalty / STIFFER), []
    for contact in progress(list(contacts)):
        motion = elements_under(body, contact, rayleigh, points)
        try:
            stroke_states = motion.touched_steps(duration_s / steps, steps, TOLERANCE, passes=1)
            states.append(np.array([each.x - motion.rest for each in stroke_states]))
        except NotConverged as failure:
            failed = failure
    if len(states) < LEAST_SHARE * len(contacts):
        raise NotConverged(f"{len(contacts) - len(states)} of {len(contacts)} strokes are not found: {failed}", [])
    return np.concatenate(states)
