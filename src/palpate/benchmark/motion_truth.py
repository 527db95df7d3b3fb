"""Find how a body moves: the limit of quadratic elements on ever finer levels, at ever shorter steps.

All levels take the same steps, and what remains is their limit as ``benchmark.truth`` finds it. What shorter steps
change of it is taken from a coarser level, where they cost little: steps of half the length on the second one show it,
as the error of the midpoint rule falls with the square of the step. The truth's own error has three parts: what the
levels leave unexplained, what the next such extrapolation differs by on the first level, and by how much the effect of
the step differs between the first and the second level. Where instruments touch the body, levels are meshes that are
refined there, and the force on it is found as the displacement is.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from palpate.benchmark.accuracy import TruthErrors, patch_nodes, truth_errors
from palpate.benchmark.refined_motions import RefinedMotions
from palpate.benchmark.richardson import limit_over
from palpate.benchmark.truth import objection
from palpate.bodies.body import Body
from palpate.bodies.refinement import quadratic_prolongation, with_midpoints
from palpate.effects.settings import Loads, Rayleigh
from palpate.solvers.quadratic_motion import QuadraticMotion, Reached

TOLERANCE = 2e-3
"""Of the forces in a step that do not balance, over the largest load: it changes the liver's motion by 0.003 % of its
peak, which is a thirtieth of what the truth is known to."""


@dataclass(frozen=True, eq=False)
class MotionTruth:
    """A truth of f frames on the n surface nodes of a body's finest level.

    displacement : (f, n, 3) [m], the limit
    own : (4, k), the k TruthErrors that it may have itself: of space, of time, of their mixture, and together
    ratio : by how much the last halving of the elements reduced the change
    least_det : the least determinant of the deformation gradient of all levels at the ends of frames
    rejected : why the limit is not believed, or ""
    tried : (m, f, n, 3) [m], the motions it is made of, of ``tried_level`` (m,) and ``tried_nodes`` (m,), in
        ``tried_steps`` (m,) steps; seconds, step_p95_s, step_max_s : (m,) of all steps, those of the coarser levels
        that it began with included, and the 95th percentile and the largest of its own
    balance : of the motion on the finest level, how much of the work of the loads is neither kept nor damped
    spent_s : time of all motions together [s]
    force, tried_force : (f, k, 3) and (m, f, k, 3) [N] of k instruments on the body, mean over each frame
    own_force : what the force may be wrong by, RMS over all frames over its peak; NaN where nothing touches
    """

    displacement: np.ndarray
    own: np.ndarray
    ratio: float
    least_det: float
    rejected: str
    tried: np.ndarray
    tried_level: np.ndarray
    tried_nodes: np.ndarray
    tried_steps: np.ndarray
    seconds: np.ndarray
    step_p95_s: np.ndarray
    step_max_s: np.ndarray
    balance: float
    spent_s: float
    force: np.ndarray
    tried_force: np.ndarray
    own_force: float

    @property
    def own_error(self) -> float:
        """The RMS of what it may be wrong by, over all frames and nodes, over the peak."""
        return float(self.own[3, TruthErrors._fields.index("rmse_of_peak")])

    def described(self, duration_s: float) -> dict[str, Any]:
        """Return the columns ``reference_*`` of dynamic_accuracy.csv of a scene of ``duration_s`` [s]."""
        finest = int(self.tried_level.argmax())
        return {
            "reference": "fem_p2",
            "reference_level": int(self.tried_level[finest]),
            "reference_nodes": int(self.tried_nodes[finest]),
            "reference_step_s": duration_s / int(self.tried_steps[finest]),
            "reference_change": float(self.own[1, TruthErrors._fields.index("rmse_of_peak")]),
            "reference_error": self.own_error,
            "reference_force_change": np.nan,
            "reference_force_error": self.own_force,
        }


@dataclass(eq=False)
class _Run:
    """A motion on one level: ``surface`` (f, n, 3) [m] at the ends of frames, and ``middles`` of its steps."""

    level: int
    nodes: int
    steps: int
    surface: list[np.ndarray]
    middles: list[np.ndarray]
    seconds: list[float]
    begun_s: float
    least_det: float
    convex: bool
    balance: float
    forces: np.ndarray

    @property
    def whole_s(self) -> float:
        return self.begun_s + sum(self.seconds)


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
    """Find the truth of a body's motion from rest.

    loads, rayleigh : as ``QuadraticMotion`` takes them; frames : equal parts of ``duration_s`` [s]
    steps : of all levels, a multiple of ``frames``
    count : of levels, at least 3, of which the first is the coarsest of the shape of the finest
    progress : wraps the sequence of motions, as ``tqdm`` does
    like : the truth of a motion of the same body in the same steps; two levels then find another at a fifth of the
        cost, with the ratio of that one, and its own errors of time
    Raises InputError as ``QuadraticMotion`` does, and NotConverged for a step that is not found.
    """
    meshes: _Levels | RefinedMotions = (
        RefinedMotions(body, loads, rayleigh, duration_s, steps)
        if loads.contact
        else _Levels(body, count if like is None else 2, loads, rayleigh)
    )
    if like is None:
        halvings = [(0, 0), (0, 1), (0, 2), (1, 1), *((finer, 0) for finer in range(1, count))]
    else:
        halvings = [(0, 0), (0, 1), (1, 0)]
    runs: dict[tuple[int, int], _Run] = {}
    motion: QuadraticMotion | None = None
    level = -1
    for finer, halved in progress(halvings):
        if motion is None or meshes.first + finer != level:
            motion, level = None, meshes.first + finer  # before the next one is made, which is eight times as large
            motion, up = meshes.motion(level)
        before = runs.get((finer - 1, halved)) if meshes.nested else None
        number = steps * 2**halved
        h = duration_s / number
        if meshes.nested and not runs:  # what the first step compiles is no part of a time
            next(meshes.steps(motion, level, h, number, []))
        reached = meshes.steps(motion, level, h, number, before.middles if before is not None else [])
        runs[finer, halved] = _run(motion, up, reached, level, number, frames, before)
    return _judged(meshes.patch, runs, like)


class _Levels:
    """The levels of a body, each of which begins with what the level before has found.

    first : the coarsest of the shape of the finest
    """

    nested = True

    def __init__(self, body: Body, count: int, loads: Loads, rayleigh: Rayleigh):
        self.first = 0 if body.smooth is not None else body.shape_level
        self._body, self._moved = body, (loads, rayleigh)
        self._whole, self.patch = with_midpoints(body, self.first + count - 1), pressed_nodes(body, loads)

    def motion(self, level: int) -> tuple[QuadraticMotion, sparse.csr_array]:
        """Return the motion on a level, and the map of its nodes to the fine surface."""
        motion, body, levels = QuadraticMotion(self._whole, level, *self._moved), self._body, self._whole.levels
        last = max(level + 1, len(body.levels) - 1)
        surface = body.fine.surface
        shape = len(surface), len(levels[last].nodes)
        up = sparse.csr_array((np.ones(shape[0]), (np.arange(shape[0]), surface)), shape=shape)
        for k in range(last - 2, level - 1, -1):
            up = up @ quadratic_prolongation(*levels[k : k + 2])
        return motion, up

    def steps(
        self, motion: QuadraticMotion, level: int, h: float, count: int, before: list[np.ndarray]
    ) -> Iterator[Reached]:
        """Yield the ends of ``count`` steps of ``h`` [s]; before : middles (n, 3) [m] of the steps a level before."""
        begun = {}
        if before:
            up = quadratic_prolongation(*self._whole.levels[level - 1 : level + 1])
            begun = {"coarser": (up @ middle for middle in before)}
        return motion.steps(h, count, TOLERANCE, **begun)


def _run(
    motion: QuadraticMotion,
    up: sparse.csr_array,
    steps: Iterator[Reached],
    level: int,
    count: int,
    frames: int,
    before: _Run | None,
) -> _Run:
    """Follow a motion on one mesh in ``count`` steps, from what the level before found of it."""
    rest = motion.mesh.nodes
    begun_s = before.whole_s if before else 0.0
    done = _Run(level, len(rest), count, [], [], [], begun_s, np.inf, True, 0.0, np.zeros((0, 0, 3)))
    work, lost, forces, last = 0.0, 0.0, [], perf_counter()
    for number, reached in enumerate(steps, start=1):
        done.seconds.append(perf_counter() - last)
        work, lost = work + reached.work_j, lost + reached.lost_j
        done.middles.append(reached.middle)
        forces.append(reached.forces)
        done.convex &= reached.convex
        if number % (count // frames) == 0:
            done.surface.append(up @ (reached.x - rest))
            done.least_det = min(done.least_det, motion.least_det(reached.x))
        last = perf_counter()
    done.balance = abs(motion.total_energy(reached.x, reached.v) + lost - work) / abs(work)
    done.forces = np.array(forces).reshape(frames, count // frames, -1, 3).mean(axis=1)
    return done


class _Moved(NamedTuple):
    """Displacements (f, n, 3) [m] at the ends of frames, and forces (f, k, 3) [N] of instruments over them."""

    displacement: np.ndarray
    force: np.ndarray


BY_STEP = 4.0
"""By how much steps of half the length reduce the error: they are of order 2."""


def _judged(pressed: np.ndarray, runs: dict[tuple[int, int], _Run], like: MotionTruth | None) -> MotionTruth:
    """Extrapolate ``runs``, by how often elements and steps are halved; ``pressed`` (n,) bool."""
    moved = {key: _Moved(np.array(run.surface), run.forces) for key, run in runs.items()}
    by_element, centre = (None, (1, 0)) if like is None else (like.ratio, (0, 0))
    limit = limit_over(moved, centre, (by_element, BY_STEP))

    def errors(wrong: _Moved, truth: _Moved) -> tuple[float, ...]:
        force = force_errors(wrong.force, truth.force).force_rms_of_peak
        return *surface_errors(wrong.displacement, truth.displacement), force

    def surface_errors(wrong: np.ndarray, truth: np.ndarray) -> TruthErrors:
        return truth_errors(wrong.reshape(-1, 3), truth.reshape(-1, 3), np.tile(pressed, len(truth)))

    parts = limit.own(errors)
    own, of_force = parts[:, :-1], parts[:, -1]
    if like is not None:  # what its three levels leave unexplained is by the ratio larger a level before
        own = np.array([np.maximum(own[0], like.ratio * like.own[0]), *like.own[1:3]])
    own = np.vstack([own, np.sqrt(np.sum(own**2, axis=0))])
    last = max(key for key in runs if not key[1])
    change = surface_errors(moved[last[0] - 1, 0].displacement, moved[last].displacement).rmse_of_peak
    least_det = min(run.least_det for run in runs.values())
    convex = all(run.convex for run in runs.values())
    rate = limit.ratios[0].displacement
    whole_own = float(own[3, TruthErrors._fields.index("rmse_of_peak")])
    tried = [runs[key] for key in sorted(runs)]
    return MotionTruth(
        displacement=limit.answer.displacement,
        own=own,
        ratio=rate,
        least_det=least_det,
        rejected=objection(rate, whole_own, change, least_det, not convex),
        tried=np.array([run.surface for run in tried]),
        tried_level=np.array([run.level for run in tried]),
        tried_nodes=np.array([run.nodes for run in tried]),
        tried_steps=np.array([run.steps for run in tried]),
        seconds=np.array([run.whole_s for run in tried]),
        step_p95_s=np.array([np.percentile(run.seconds, 95) for run in tried]),
        step_max_s=np.array([max(run.seconds) for run in tried]),
        balance=runs[last].balance,
        spent_s=sum(sum(run.seconds) for run in tried),
        force=limit.answer.force,
        tried_force=np.array([run.forces for run in tried]),
        own_force=float(np.linalg.norm(of_force)),
    )


def pressed_nodes(body: Body, loads: Loads) -> np.ndarray:
    """Mark the surface nodes (n,) that a push presses; all of them where there is none."""
    fine, marked = body.fine, np.zeros(len(body.fine.surface), dtype=bool)
    for push in loads.pushes:
        near = np.linalg.norm(fine.nodes[fine.surface] - push.at_m, axis=1).argmin()
        marked |= patch_nodes(fine, int(fine.surface[near]), push.radius_m)
    return marked if marked.any() else ~marked


class ForceErrors(NamedTuple):
    """How wrong the force of instruments is over time, NaN where nothing touches or a model tells none.

    force_rms_of_peak : RMS over frames and instruments of the error vector, over the largest true force
    force_peak_error : of the largest force, over the true one; positive where it is too large
    """

    force_rms_of_peak: float = np.nan
    force_peak_error: float = np.nan


def force_errors(found: np.ndarray, true: np.ndarray) -> ForceErrors:
    """Measure forces (f, k, 3) [N] of k instruments in f frames against the ``true`` ones (f, k, 3) [N]."""
    peak = np.linalg.norm(true, axis=2).max(initial=0.0)
    if not peak or found.shape != true.shape:
        return ForceErrors()
    off = np.sqrt(np.mean(np.sum((found - true) ** 2, axis=2)))
    return ForceErrors(float(off / peak), float(np.linalg.norm(found, axis=2).max() / peak - 1.0))
