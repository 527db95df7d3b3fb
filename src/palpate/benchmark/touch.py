"""Describe touches by an instrument: which are asked for, what a model answers, its errors, and the truth."""

import warnings
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import patch_nodes, truth_errors
from palpate.benchmark.model import LeftOut, held_mb
from palpate.benchmark.settings import Given
from palpate.bodies.body import Body
from palpate.bodies.contacts import surface_contacts
from palpate.effects.instrument import GRASP, Instrument, Pose, first_touch, upright
from palpate.errors import InputError, NotConverged
from palpate.solvers.grasping import GraspedPatch, patch_around

Made = TypeVar("Made")
TOUCH_COLUMNS = ["sample", "node", "direction_x", "direction_y", "direction_z", "depth_m", "asked_m"]
LARGEST = 1.5
"""How far what a grasp holds may reach, over its radius."""
BEFORE = 0.8
"""Share of the depth at which the force is asked for, too: the stiffness is the slope between them."""


@dataclass(frozen=True, eq=False)
class Touch:
    """An instrument that is pushed into a body from where it first touches, or that pulls the patch that it grasps.

    node : of the fine surface, above which the tip stands before the motion, along the normal there
    direction : unit vector (3,) of the motion; depth_m : its length from first touch [m]
    poses : cached by ``pose``, where the instrument first touches each body
    """

    instrument: Instrument
    node: int
    direction: np.ndarray
    depth_m: float
    poses: dict[Body, Pose] = field(default_factory=dict)

    @property
    def grasps(self) -> bool:
        """Whether the instrument holds a patch of the surface."""
        return self.instrument.kind == GRASP

    def patch(self, body: Body) -> GraspedPatch:
        """Return the triangles of ``body`` that a grasp holds; InputError where these reach far beyond its radius."""
        radius = self.instrument.radius_m
        held = patch_around(body.fine, self.node, radius)
        reach = float(np.linalg.norm(held.corners - body.fine.nodes[self.node], axis=2).max())
        if reach > LARGEST * radius:
            raise InputError(
                f"bodies.{body.name}: triangles reach {1e3 * reach:.2g} mm from a place, and a grasp holds whole ones; "
                f"give it a larger radius_m than {radius:g}, or the body more refinements."
            )
        return held

    @property
    def before(self) -> "Touch":
        """The same touch at the share BEFORE of its depth."""
        return replace(self, depth_m=BEFORE * self.depth_m)

    def pose(self, body: Body) -> Pose:
        """Return where the instrument first touches ``body``; InputError where it does not."""
        if body not in self.poses:
            held = upright(self.instrument, body.fine.nodes[self.node], body.fine.normals[self.node])
            self.poses[body] = held if self.grasps else first_touch(held, body.fine, self.direction)
        return self.poses[body]


class Touched(NamedTuple):
    """The answer to a touch, with NaN for what a model does not compute.

    displacement : (n_surface, 3) [m] of the fine surface
    force_n : the instrument's force along its direction [N]
    area_m2 : of contact [m²]
    reaction_n : the same force summed over the body's supports [N]
    """

    displacement: np.ndarray
    force_n: float
    area_m2: float = np.nan
    reaction_n: float = np.nan


class TouchErrors(NamedTuple):
    """Errors of one answer to a touch against the truth.

    rmse_of_peak, patch_rms_of_peak, patch_max_of_peak, max_of_peak : as in ``TruthErrors``; the patch is the surface
        within a radius of the instrument from where it first touches
    force_error, contact_area_error, stiffness_error : relative, positive where the answer is too large, NaN where a
        model does not give it; the stiffness is the slope of the force over the last part of the depth
    """

    rmse_of_peak: float
    patch_rms_of_peak: float
    patch_max_of_peak: float
    max_of_peak: float
    force_error: float
    stiffness_error: float
    contact_area_error: float


def touch_errors(answer: Touched, truth: Touched, patch: np.ndarray, stiffness_error: float = np.nan) -> TouchErrors:
    """Measure an answer against the truth; patch : (n_surface,) bool, the nodes that are pressed."""
    errors = truth_errors(answer.displacement, truth.displacement, patch)
    force, area = answer.force_n / truth.force_n - 1.0, answer.area_m2 / truth.area_m2 - 1.0
    of_peak = errors.rmse_of_peak, errors.patch_rms_of_peak, errors.patch_max_of_peak, errors.max_of_peak
    return TouchErrors(*of_peak, float(force), stiffness_error, float(area))


def patch_of(body: Body, touch: Touch) -> np.ndarray:
    """Mark the fine surface nodes within a radius of the instrument from where it first touches, (n_surface,) bool.

    For a grasp they are those within two radii that it does not hold, as all models move what it holds alike.
    """
    if touch.grasps:
        beside = patch_nodes(body.fine, touch.node, 2.0 * touch.instrument.radius_m)
        return beside & ~np.isin(body.fine.surface, touch.patch(body).nodes_of(body.fine))
    return patch_nodes(body.fine, touch.node, touch.instrument.radius_m)


@dataclass(frozen=True, eq=False)
class TouchTruth:
    """The truth of k touches on the n fine surface nodes of a body.

    sample : (k,); displacement : (k, n, 3) [m]; area : (k,) [m²]
    force : (k, 2) [N], at the share BEFORE of the depth and at all of it
    pressure : (k,) [Pa], the greatest, on the finest mesh
    own : (k, len(TouchErrors)) the truth's own errors
    order : (k,) observed order of convergence of the displacement, by halving at what is held
    force_order : (k,) observed order of convergence of the force, by halving where it is touched
    overlap : (k,) mean overlap over the depth, and least_det : (k,) least det F, on the mesh that is finest where it is
        touched; edge_m : (k,) the length of its edges there [m]
    nodes : (k,) of the largest mesh
    rejected : (k,) why a touch judges no model, or ""
    seconds : (k,) [s]
    """

    sample: np.ndarray
    displacement: np.ndarray
    force: np.ndarray
    area: np.ndarray
    pressure: np.ndarray
    own: np.ndarray
    order: np.ndarray
    force_order: np.ndarray
    overlap: np.ndarray
    least_det: np.ndarray
    nodes: np.ndarray
    edge_m: np.ndarray
    rejected: np.ndarray
    seconds: np.ndarray

    @property
    def believed(self) -> np.ndarray:
        """Truth values (k,): which touches judge models."""
        return self.rejected == ""

    def answer(self, row: int) -> Touched:
        """Return the truth of one row."""
        return Touched(self.displacement[row], float(self.force[row, 1]), float(self.area[row]))


class TouchDoubted(NotConverged):
    """An answer that its model does not believe."""


@dataclass(frozen=True, eq=False)
class TouchCase:
    """One body under one instrument: all that a model may know before a touch is asked.

    deepest_m : no touch is deeper [m]
    seed : of every random choice
    grid : the values to try of the settings of models
    kept : what ``share`` has made, by name
    """

    body: Body
    instrument: Instrument
    deepest_m: float
    seed: int
    grid: Any = None
    kept: dict[Hashable, Any] = field(default_factory=dict)

    def share(self, name: Hashable, make: Callable[[], Made]) -> Made:
        """Return what ``make`` makes, made once for all models and settings of this case."""
        if name not in self.kept:
            self.kept[name] = make()
        return self.kept[name]


class TouchSolver:
    """A prepared setting of a model, which answers touches.

    The module of a model has two functions of a ``TouchCase``: ``settings(case)``, a list of dictionaries from cheap to
    expensive, and ``online(case, **setting)``, which returns such a solver. Both raise NotConverged where there is
    none, and its kind LeftOut for a body that the model does not know.
    """

    def prepare(self, touch: Touch) -> None:
        """Prepare for touches at the place of ``touch``, of any depth and direction; timed apart, once a touch."""

    def respond(self, touch: Touch) -> Touched:
        """Return the answer; this is timed. NotConverged where there is none, TouchDoubted where it is not believed."""
        raise NotImplementedError

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb(self)


def refuse_sticking(case: TouchCase, what: str) -> None:
    """Raise LeftOut for an instrument that tissue sticks to, or that grasps it, which ``what`` do not know."""
    if case.instrument.sticks or case.instrument.kind == GRASP:
        raise LeftOut(f"{what} know no tissue that sticks to an instrument", [float("nan")])


def given_touches(body: Body, instrument: Instrument, given: Sequence[Given]) -> pd.DataFrame:
    """Return the touches at the places ``given`` in a config, a row with TOUCH_COLUMNS for each depth.

    The surface node nearest to ``at_m`` is touched; without a direction, along the inward normal, and by a grasp along
    the outward one.
    InputError for a point that is off the surface or on what is held, for a direction out of the body, and for an
    instrument that would be pushed through all of it.
    """
    mesh, allowed, pulls = body.fine, places_to_touch(body), instrument.kind == GRASP
    corners = mesh.nodes[mesh.triangles]
    longest_edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())
    rows: list[list[float]] = []
    for i, each in enumerate(given):
        away_m = np.linalg.norm(mesh.nodes[mesh.surface] - each.at_m, axis=1)
        node, place = int(mesh.surface[away_m.argmin()]), f"touch.at[{i}]"
        if away_m.min() > longest_edge:
            raise InputError(
                f"{place}.at_m is {away_m.min():.3g} m off the surface of {body.name}; give a point on it, in metres."
            )
        if node not in allowed:
            raise InputError(f"{place}.at_m is where {body.name} is held, or beside; give another place.")
        outward = mesh.normals[node]
        direction = outward if pulls else -outward
        if each.direction is not None:
            direction = np.array(each.direction, dtype=float)
        if direction @ outward >= 0.0 and not pulls:
            raise InputError(f"{place}.direction points out of {body.name} there; give a way into it, or null.")
        direction = direction / np.linalg.norm(direction)
        thick = float(np.ptp(mesh.nodes @ direction))
        for depth in each.depths_m:
            if depth >= thick and not pulls:
                raise InputError(
                    f"{place}.depths_m has {depth:g}, and {body.name} is {thick:.3g} m thick along that way; give less."
                )
            rows.append([len(rows), node, *direction, depth, depth])
    return pd.DataFrame(rows, columns=TOUCH_COLUMNS).astype({"sample": int, "node": int})


def touches_of(instrument: Instrument, table: pd.DataFrame) -> list[Touch]:
    """Return the touches of the rows of a table with TOUCH_COLUMNS."""
    directions = table[["direction_x", "direction_y", "direction_z"]].to_numpy(dtype=float)
    rows = zip(table["node"], directions, table["depth_m"], strict=True)
    return [Touch(instrument, int(node), direction, float(depth)) for node, direction, depth in rows]


TILT = 45.0
"""Largest angle [degrees] of every other touch to the inward normal."""
LOWER, FALLS = 0.7, 4
"""Factor by which a touch that is too deep for the body is lowered, and how often; then another place is taken."""


def choose_touches(
    body: Body,
    instrument: Instrument,
    count: int,
    depth_of_radius: tuple[float, float],
    seed: int,
    has_equilibrium: Callable[[Touch], bool],
) -> pd.DataFrame:
    """Choose ``count`` touches, rows with TOUCH_COLUMNS: places (three tried for each at most) by area, depths evenly.

    Every other touch is tilted from the normal, by TILT at most. A grasp pulls outward, other instruments push inward.
    depth_of_radius : least and largest depth over the radius
    has_equilibrium : tells this of the body under a touch; where it has none, the touch is made less deep, and after
        FALLS tries another place is taken
    Warns of touches that were made less deep and places that were left; InputError where no place can be touched.
    """
    rng, allowed = np.random.default_rng(seed), places_to_touch(body)
    order = allowed[np.argsort(rng.exponential(size=len(allowed)) / body.fine.areas[allowed])]
    rows: list[list[float]] = []
    given_up = lowered = 0
    for node in order[: 3 * count]:
        if len(rows) == count:
            break
        tilt = np.deg2rad(TILT * rng.random()) if len(rows) % 2 else 0.0
        turn_rad, depth_m = 2.0 * np.pi * rng.random(), float(rng.uniform(*depth_of_radius)) * instrument.radius_m
        side_1, side_2, outward = upright(instrument, body.fine.nodes[node], body.fine.normals[node]).axes
        outward_part = np.cos(tilt) if instrument.kind == GRASP else -np.cos(tilt)
        direction = outward_part * outward + np.sin(tilt) * (np.cos(turn_rad) * side_1 + np.sin(turn_rad) * side_2)
        for fall in range(FALLS):
            if has_equilibrium(touch := Touch(instrument, int(node), direction, depth_m * LOWER**fall)):
                rows.append([len(rows), node, *direction, touch.depth_m, depth_m])
                lowered += fall > 0
                break
        else:
            given_up += 1
    if not rows:
        raise InputError(f"bodies.{body.name}: no place bears the {instrument.name}; take a smaller one, or less deep.")
    if given_up or lowered:
        said = f"bodies.{body.name}, {instrument.name}: {lowered} of {len(rows)} touches were made less deep, and"
        warnings.warn(f"{said} {given_up} places left, as the body gives way there or is squeezed flat.", stacklevel=2)
    table = pd.DataFrame(rows, columns=TOUCH_COLUMNS)
    return table.astype({"sample": int, "node": int})


def places_to_touch(body: Body) -> np.ndarray:
    """Return the fine surface nodes, increasing, that are neither held nor neighbours of one that is."""
    held = np.isin(np.arange(len(body.fine.nodes)), body.supported(len(body.levels) - 1))
    near = body.fine.triangles[held[body.fine.triangles].any(axis=1)]
    return np.setdiff1d(surface_contacts(body), near)
