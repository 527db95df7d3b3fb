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
from palpate.benchmark.richardson import RATIO_DOUBT, estimate, ratio
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
    first = meshes.first
    if like is None:
        wanted = [(first, steps), (first, 2 * steps), (first, 4 * steps), (first + 1, 2 * steps)]
    else:
        wanted, count = [(first, steps), (first, 2 * steps)], 2
    wanted += [(first + more, steps) for more in range(1, count)]
    found: dict[tuple[int, int], _Run] = {}
    motion: QuadraticMotion | None = None
    level = -1
    for own, number in progress(wanted):
        if motion is None or own != level:
            motion, level = None, own  # before the next one is made, which is eight times as large
            motion, up = meshes.motion(own)
        before = found.get((level - 1, number)) if meshes.nested else None
        h = duration_s / number
        if meshes.nested and not found:  # what the first step compiles is no part of a time
            next(meshes.steps(motion, own, h, number, []))
        reached = meshes.steps(motion, own, h, number, before.middles if before is not None else [])
        found[own, number] = _run(motion, up, reached, level, number, frames, before)
    return _judged(meshes.patch, first, steps, count, found, like)


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


def _judged(
    pressed: np.ndarray,
    first: int,
    steps: int,
    count: int,
    found: dict[tuple[int, int], _Run],
    like: MotionTruth | None,
) -> MotionTruth:
    """Extrapolate the motions that were ``found``, by level and number of steps."""
    moved = {key: np.array(run.surface) for key, run in found.items()}
    shape, patch = moved[first, steps].shape, np.tile(pressed, len(moved[first, steps]))
    flat = {key: each.reshape(-1, 3) for key, each in moved.items()}
    levels = np.array([flat[first + more, steps] for more in range(count)])
    whole, half = flat[first, steps], flat[first, 2 * steps]
    of_time = time_first = _shorter(whole, half) - whole
    if like is None:
        rate, (by_space, off_space) = ratio(levels), estimate(levels)
        of_time = _shorter(levels[1], flat[first + 1, 2 * steps]) - levels[1]
        off_steps = [_shorter(half, flat[first, 4 * steps]) - _shorter(whole, half), of_time - time_first]
    else:
        rate, last = like.ratio, levels[1] - levels[0]
        off_steps = []
        by_space, off_space = levels[1] + last / (rate - 1.0), (RATIO_DOUBT / (rate - 1.0) ** 2 * last,)
    truth = by_space + of_time

    def size(*vectors: np.ndarray) -> np.ndarray:
        return np.max([truth_errors(truth + each, truth, patch) for each in vectors], axis=0)

    parts = np.array([size(*off_space), *(size(each) for each in off_steps)])
    if like is not None:  # what its three levels leave unexplained is by the ratio larger a level before
        parts = np.array([np.maximum(parts[0], like.ratio * like.own[0]), *like.own[1:3]])
    own = np.vstack([parts, np.sqrt(np.sum(parts**2, axis=0))])
    change = truth_errors(levels[-2], levels[-1], patch).rmse_of_peak
    least_det = min(run.least_det for run in found.values())
    convex = all(run.convex for run in found.values())
    force, own_force = _true_force(first, steps, count, found)
    whole_own = float(own[3, TruthErrors._fields.index("rmse_of_peak")])
    runs = sorted(found.values(), key=lambda run: (run.level, run.steps))
    return MotionTruth(
        displacement=truth.reshape(shape),
        own=own,
        ratio=rate,
        least_det=least_det,
        rejected=objection(rate, whole_own, change, least_det, not convex),
        tried=np.array([moved[run.level, run.steps] for run in runs]),
        tried_level=np.array([run.level for run in runs]),
        tried_nodes=np.array([run.nodes for run in runs]),
        tried_steps=np.array([run.steps for run in runs]),
        seconds=np.array([run.whole_s for run in runs]),
        step_p95_s=np.array([np.percentile(run.seconds, 95) for run in runs]),
        step_max_s=np.array([max(run.seconds) for run in runs]),
        balance=found[first + count - 1, steps].balance,
        spent_s=sum(sum(run.seconds) for run in runs),
        force=force,
        tried_force=np.array([run.forces for run in runs]),
        own_force=own_force,
    )


def _true_force(first: int, steps: int, count: int, found: dict[tuple[int, int], _Run]) -> tuple[np.ndarray, float]:
    """Extrapolate the forces of instruments as displacements are; return them (f, k, 3) [N], and their own error."""
    felt = {key: run.forces for key, run in found.items()}
    shape = felt[first, steps].shape
    if not shape[1] or (first, 4 * steps) not in felt:
        return felt[first + count - 1, steps], np.nan
    levels = np.array([felt[first + more, steps].reshape(-1, 3) for more in range(count)])
    by_space, off_space = estimate(levels)
    effects = [_shorter(felt[k, n], felt[k, 2 * n]) - felt[k, n] for k, n in ((first, steps), (first + 1, steps))]
    later = _shorter(felt[first, 2 * steps], felt[first, 4 * steps]) - felt[first, steps]
    force = by_space.reshape(shape) + effects[1]
    space = max(float(np.linalg.norm(off)) for off in off_space)
    parts = [space, *(float(np.linalg.norm(off)) for off in (later - effects[0], effects[1] - effects[0]))]
    peak, cells = np.linalg.norm(force, axis=2).max(), np.sqrt(shape[0] * shape[1])
    return force, float(np.linalg.norm(parts) / (cells * peak))


def _shorter(longer: np.ndarray, shorter: np.ndarray) -> np.ndarray:
    """Extrapolate motions at a step and at half of it to steps of no length."""
    return shorter + (shorter - longer) / 3.0


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
