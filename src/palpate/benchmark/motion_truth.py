"""Find the truth of motions: the limit of quadratic elements on ever finer levels, at ever shorter steps.

All levels take the same steps, and their limit is found as that of presses. The effect of shorter steps is taken from
the second level, where they cost little, with steps of half the length: the error of the midpoint rule falls with the
square of the step. The truth's own error has three parts: that of the levels, the change by the next halving of steps
on the first level, and the difference between the effects of steps on the first and the second level. Where instruments
touch the body, levels are meshes that are refined there, and the limit of the force is found, too.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from palpate.benchmark.accuracy import TruthErrors, patch_nodes, truth_errors
from palpate.benchmark.richardson import limit_over
from palpate.benchmark.touch_mesh import refined
from palpate.benchmark.truth import objection
from palpate.bodies.body import Body
from palpate.bodies.fine_surface_map import FineSurfaceMap
from palpate.bodies.refinement import quadratic_prolongation, with_midpoints
from palpate.collision.contact.instrument_contact import instruments_of
from palpate.effects.settings import Loads, Rayleigh
from palpate.errors import NotConverged
from palpate.solvers.indentation import contact_points
from palpate.solvers.quadratic_motion import QuadraticMotion, Reached
from palpate.solvers.touched_motion import TouchedMotion

TOLERANCE = 2e-3
"""Of the forces in a step that do not balance, over the largest load: it changes the liver's motion by 0.003 % of its
peak, which is a thirtieth of what the truth is known to."""


@dataclass(frozen=True, eq=False)
class MotionRun:
    """A simulated motion on one level in a number of ``steps``.

    surface : (f, n, 3) [m] at the ends of frames; force : (f, k, 3) [N] of k instruments on the body, mean over each
    begun_s, own_s : time of the motions on coarser levels from which its steps start, and its own [s]
    step_p95_s, step_max_s : time of a step, 95th percentile and largest [s]
    least_det : the least determinant of the deformation gradient at the ends of frames
    convex : whether no Hessian had to be made positive definite
    balance : error of the energy balance over the work of the loads
    """

    level: int
    nodes: int
    steps: int
    surface: np.ndarray
    force: np.ndarray
    begun_s: float
    own_s: float
    step_p95_s: float
    step_max_s: float
    least_det: float
    convex: bool
    balance: float

    @property
    def seconds(self) -> float:
        """The time of the motion, with those of coarser levels from which its steps start [s]."""
        return self.begun_s + self.own_s


@dataclass(frozen=True, eq=False)
class MotionTruth:
    """A truth of f frames on the n surface nodes of a body's finest level.

    displacement : (f, n, 3) [m], the limit
    own : (4, k) its own k TruthErrors: of space, of time, of their mixture, and the root of their sum of squares
    ratio : of the last two changes by halving the elements
    rejected : why the limit is not believed, or ""
    tried : the simulated motions, by level and then by steps
    force : (f, k, 3) [N] of k instruments on the body, mean over each frame
    own_force : own error of the force, RMS over all frames over its peak; NaN where nothing touches
    """

    displacement: np.ndarray
    own: np.ndarray
    ratio: float
    rejected: str
    tried: tuple[MotionRun, ...]
    force: np.ndarray
    own_force: float

    @property
    def finest(self) -> MotionRun:
        """The motion on the finest level."""
        return max(self.tried, key=lambda each: each.level)

    @property
    def spent_s(self) -> float:
        """The time of all motions together [s]."""
        return sum(each.own_s for each in self.tried)

    @property
    def own_error(self) -> float:
        """The own RMS error over all frames and nodes, over the peak."""
        return float(self.own[3, TruthErrors._fields.index("rmse_of_peak")])

    def described(self, duration_s: float) -> dict[str, Any]:
        """Return the columns ``reference_*`` of dynamic_accuracy.csv of a scene of ``duration_s`` [s]."""
        return {
            "reference": "fem_p2",
            "reference_level": self.finest.level,
            "reference_nodes": self.finest.nodes,
            "reference_step_s": duration_s / self.finest.steps,
            "reference_change": float(self.own[1, TruthErrors._fields.index("rmse_of_peak")]),
            "reference_error": self.own_error,
            "reference_force_change": np.nan,
            "reference_force_error": self.own_force,
        }


def motion_truth(
    body: Body,
    loads: Loads,
    rayleigh: Rayleigh,
    duration_s: float,
    frames: int,
    steps: int,
    count: int = 3,
    progress: Callable = iter,
    like: MotionTruth | None = None,
) -> MotionTruth:
    """Find the truth of a body's motion from rest: extrapolate runs with ever finer elements and shorter steps.

    loads, rayleigh : as ``QuadraticMotion`` takes them
    frames : number of equal parts of ``duration_s`` [s], at whose ends the surface is taken
    steps : number of time steps on all levels, a multiple of ``frames``
    count : number of levels, at least 3, of which the first is the coarsest of the shape of the finest
    progress : wraps the sequence of motions, as ``tqdm`` does
    like : the truth of another motion of the same body in the same steps, whose ratio and own errors are taken, so
        that two levels suffice, at a fifth of the time
    Raises InputError as ``QuadraticMotion`` does, and NotConverged for a step without a solution.
    """
    meshes: _Levels | _TouchedLevels = (
        _TouchedLevels(body, loads, rayleigh, duration_s, steps)
        if loads.contact
        else _Levels(body, count if like is None else 2, loads, rayleigh)
    )
    # how often elements (n_space) and steps (n_time) are halved; a run starts from that with one n_space less
    if like is None:
        halvings = [(0, 0), (0, 1), (0, 2), (1, 1), *((n_space, 0) for n_space in range(1, count))]
    else:
        halvings = [(0, 0), (0, 1), (1, 0)]
    runs: dict[tuple[int, int], MotionRun] = {}
    middles: dict[tuple[int, int], list[np.ndarray]] = {}
    motion: QuadraticMotion | None = None
    level = -1
    for n_space, n_time in progress(halvings):
        if motion is None or meshes.first + n_space != level:
            motion, level = None, meshes.first + n_space  # before the next one is made, which is eight times as large
            motion, up = meshes.motion(level)
        coarser_run = (n_space - 1, n_time) if meshes.nested and (n_space - 1, n_time) in runs else None
        n_steps = steps * 2**n_time
        step_s = duration_s / n_steps
        if meshes.nested and not runs:  # what the first step compiles is no part of a time
            next(meshes.steps(motion, level, step_s, n_steps, []))
        states = meshes.steps(motion, level, step_s, n_steps, middles[coarser_run] if coarser_run else [])
        begun_s = runs[coarser_run].seconds if coarser_run else 0.0
        runs[n_space, n_time], middles[n_space, n_time] = _simulate(motion, up, states, level, n_steps, frames, begun_s)
    return _truth_of_runs(meshes.patch, runs, like)


class _Levels:
    """The levels of a body; the steps of a motion on each start from those on the level before.

    first : the coarsest level of the shape of the finest
    patch : (n_surface,) the nodes that are pressed
    """

    nested = True

    def __init__(self, body: Body, count: int, loads: Loads, rayleigh: Rayleigh):
        self.first = 0 if body.smooth is not None else body.shape_level
        self._body, self._moved = body, (loads, rayleigh)
        self._whole, self.patch = with_midpoints(body, self.first + count - 1), pressed_nodes(body, loads)

    def motion(self, level: int) -> tuple[QuadraticMotion, sparse.csr_array]:
        """Return the motion on a level, and the map (n_surface, n) of its nodes: to finer levels, then the surface."""
        motion, body, levels = QuadraticMotion(self._whole, level, *self._moved), self._body, self._whole.levels
        finest = max(level + 1, len(body.levels) - 1)
        surface = body.fine.surface
        map_shape = len(surface), len(levels[finest].nodes)
        to_surface = sparse.csr_array((np.ones(map_shape[0]), (np.arange(map_shape[0]), surface)), shape=map_shape)
        for k in range(finest - 2, level - 1, -1):
            to_surface = to_surface @ quadratic_prolongation(*levels[k : k + 2])
        return motion, to_surface

    def steps(
        self, motion: QuadraticMotion, level: int, h: float, count: int, before: list[np.ndarray]
    ) -> Iterator[Reached]:
        """Yield the states at the ends of ``count`` steps of ``h`` [s].

        before : positions (n, 3) [m] at the middle of each step on the level before, from which steps start
        """
        starts = {}
        if before:
            prolongation = quadratic_prolongation(*self._whole.levels[level - 1 : level + 1])
            starts = {"coarser": (prolongation @ middle for middle in before)}
        return motion.steps(h, count, TOLERANCE, **starts)


TOUCHED_TOLERANCE = 1e-3
"""Of the forces in a stage that do not balance, over the largest of contact."""
MARGIN = 1.0
"""Distance from what is touched within which a mesh is refined, over its own edges."""


class _TouchedLevels:
    """Meshes of a body that are refined where instruments touch it, and the motions on them.

    A coarse motion shows which points of the surface are touched at any time. Each further mesh halves the elements
    around these, and at the rim of what is held, once more. Meshes are not nested.

    steps : number of time steps of the coarse motion
    patch : (n_surface,) the nodes within a radius of the instrument from what is touched
    InputError for instruments that are neither spheres nor capsules; NotConverged where nothing is touched.
    """

    first, nested = 0, False

    def __init__(self, body: Body, loads: Loads, rayleigh: Rayleigh, duration_s: float, steps: int):
        contact = loads.contact
        assert contact is not None
        self._base = body.from_level(body.shape_level if body.smooth is None else len(body.levels) - 1)
        self._surface, self._rayleigh = FineSurfaceMap(self._base), rayleigh
        self._loads = loads.but(contact=None)
        self._contact = instruments_of(body, contact)
        self._radius = max(each.radius_m for each in self._contact.obstacles)
        corners = self._base.coarse.nodes[self._base.coarse.triangles]
        self._edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
        self._touched = self._find_touched(duration_s / steps, steps)
        distances = cKDTree(self._touched).query(body.fine.nodes[body.fine.surface])[0]
        self.patch = distances <= self._radius

    def motion(self, number: int) -> tuple[TouchedMotion, sparse.csr_array]:
        """Return the motion on mesh ``number``, 0 the coarsest, and the map of its nodes to the body's fine surface."""
        if not number:
            return self._moved(self._base.up_to(0), 0, lambda at: np.ones(len(at), dtype=bool))
        body = refined(self._base, self._touched, MARGIN * self._edge / 2.0 ** np.arange(number), number)
        touched_tree, reach = cKDTree(self._touched), self._edge + self._radius
        return self._moved(body, number, lambda at: touched_tree.query(at)[0] <= reach)

    def _moved(
        self, body: Body, number: int, near: Callable[[np.ndarray], np.ndarray]
    ) -> tuple[TouchedMotion, sparse.csr_array]:
        points = contact_points(body.fine, 2, body.material.young_pa, near)
        whole = with_midpoints(body, number)
        moved = TouchedMotion(whole, number, self._loads, self._rayleigh, points, self._contact)
        return moved, self._surface.of(body, 2)

    def steps(
        self, motion: QuadraticMotion, number: int, h: float, count: int, before: list[np.ndarray]
    ) -> Iterator[Reached]:
        """Yield the states at the ends of steps as ``_Levels`` does; ``before`` is unused, as meshes are not nested."""
        assert isinstance(motion, TouchedMotion)  # as ``motion`` makes it
        return motion.touched_steps(h, count, TOUCHED_TOLERANCE)

    def _find_touched(self, h: float, count: int) -> np.ndarray:
        """Return the places at rest (k, 3) [m] that are touched in ``count`` steps of ``h`` [s] on mesh 0."""
        motion, _ = self.motion(0)
        rest = motion.points.interpolation @ motion.mesh.nodes
        touched = np.any([motion.bearing for _ in motion.touched_steps(h, count, TOUCHED_TOLERANCE)], axis=0)
        if not touched.any():
            raise NotConverged(
                f"{self._base.name}: no instrument touches it, or elements are too large to see it", [0.0]
            )
        return rest[touched]


def _simulate(
    motion: QuadraticMotion,
    to_surface: sparse.csr_array,
    steps: Iterator[Reached],
    level: int,
    count: int,
    frames: int,
    begun_s: float,
) -> tuple[MotionRun, list[np.ndarray]]:
    """Simulate a motion in ``count`` steps; return it, and the positions (n, 3) [m] at the middle of each step.

    to_surface : map of the mesh's nodes to the fine surface; steps : yields the states at their ends
    frames, begun_s : as of ``motion_truth`` and ``MotionRun``
    """
    rest, least_det, convex, work_j, lost_j = motion.mesh.nodes, np.inf, True, 0.0, 0.0
    surface, middles, forces, seconds, step_began = [], [], [], [], perf_counter()
    for step, state in enumerate(steps, start=1):
        seconds.append(perf_counter() - step_began)
        work_j, lost_j = work_j + state.work_j, lost_j + state.lost_j
        middles.append(state.middle)
        forces.append(state.forces)
        convex &= state.convex
        if step % (count // frames) == 0:
            surface.append(to_surface @ (state.x - rest))
            least_det = min(least_det, motion.least_det(state.x))
        step_began = perf_counter()
    balance = abs(motion.total_energy(state.x, state.v) + lost_j - work_j) / abs(work_j)
    force = np.array(forces).reshape(frames, count // frames, -1, 3).mean(axis=1)
    times = begun_s, sum(seconds), float(np.percentile(seconds, 95)), max(seconds)
    run = MotionRun(level, len(rest), count, np.array(surface), force, *times, least_det, convex, balance)
    return run, middles


class _Moved(NamedTuple):
    """The answer of one run: displacements (f, n, 3) [m] at the ends of frames, mean forces (f, k, 3) [N] over them."""

    displacement: np.ndarray
    force: np.ndarray


BY_STEP = 4.0
"""Ratio of errors by steps of half the length, which are of order 2."""


def _truth_of_runs(
    pressed: np.ndarray, runs: dict[tuple[int, int], MotionRun], like: MotionTruth | None
) -> MotionTruth:
    """Extrapolate ``runs`` to their limit, and judge it.

    pressed : (n_surface,) nodes of the patch; runs : by how often elements and steps are halved
    like : as ``motion_truth`` takes it
    """
    answers = {key: _Moved(run.surface, run.force) for key, run in runs.items()}
    element_ratio, centre = (None, (1, 0)) if like is None else (like.ratio, (0, 0))
    limit = limit_over(answers, centre, (element_ratio, BY_STEP))

    def errors(answer: _Moved, truth: _Moved) -> tuple[float, ...]:
        force = force_errors(answer.force, truth.force).force_rms_of_peak
        return *surface_errors(answer.displacement, truth.displacement), force

    def surface_errors(answer: np.ndarray, truth: np.ndarray) -> TruthErrors:
        return truth_errors(answer.reshape(-1, 3), truth.reshape(-1, 3), np.tile(pressed, len(truth)))

    own_parts = limit.own(errors)
    own, own_force = own_parts[:, :-1], own_parts[:, -1]
    if like is not None:  # ``like`` has a level more; with one level less its own error in space is larger by the ratio
        own = np.array([np.maximum(own[0], like.ratio * like.own[0]), *like.own[1:3]])
    own = np.vstack([own, np.sqrt(np.sum(own**2, axis=0))])
    finest = max(key for key in runs if not key[1])
    change = surface_errors(answers[finest[0] - 1, 0].displacement, answers[finest].displacement).rmse_of_peak
    least_det, convex = min(run.least_det for run in runs.values()), all(run.convex for run in runs.values())
    space_ratio = limit.ratios[0].displacement
    whole_own = float(own[3, TruthErrors._fields.index("rmse_of_peak")])
    return MotionTruth(
        displacement=limit.answer.displacement,
        own=own,
        ratio=space_ratio,
        rejected=objection(space_ratio, whole_own, change, least_det, not convex),
        tried=tuple(runs[key] for key in sorted(runs)),
        force=limit.answer.force,
        own_force=float(np.linalg.norm(own_force)),
    )


def pressed_nodes(body: Body, loads: Loads) -> np.ndarray:
    """Mark the surface nodes that a push presses, (n,) bool; all of them where there is none."""
    fine, marked = body.fine, np.zeros(len(body.fine.surface), dtype=bool)
    for push in loads.pushes:
        nearest = np.linalg.norm(fine.nodes[fine.surface] - push.at_m, axis=1).argmin()
        marked |= patch_nodes(fine, int(fine.surface[nearest]), push.radius_m)
    return marked if marked.any() else ~marked


class ForceErrors(NamedTuple):
    """Errors of the force of instruments over time, NaN where nothing touches or a model gives no force.

    force_rms_of_peak : RMS over frames and instruments of the error vector, over the largest true force
    force_peak_error : relative error of the largest force; positive where it is too large
    """

    force_rms_of_peak: float = np.nan
    force_peak_error: float = np.nan


def force_errors(forces: np.ndarray, true: np.ndarray) -> ForceErrors:
    """Measure forces (f, k, 3) [N] of k instruments in f frames against the ``true`` ones (f, k, 3) [N]."""
    peak = np.linalg.norm(true, axis=2).max(initial=0.0)
    if not peak or forces.shape != true.shape:
        return ForceErrors()
    rms_n = np.sqrt(np.mean(np.sum((forces - true) ** 2, axis=2)))
    return ForceErrors(float(rms_n / peak), float(np.linalg.norm(forces, axis=2).max() / peak - 1.0))
