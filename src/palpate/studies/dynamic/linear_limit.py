"""Find how far a motion is known that quadratic elements have no truth of: linear ones on nested meshes, at two steps.

Bodies that fall on each other, sheets and bodies that yield move the more differently the later it is, on other meshes
and in other steps. The limit is that of short steps on the finest mesh. It is known to what that differs by from the
mesh before it and from its own shorter step, until these part.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.benchmark.accuracy import TruthErrors, truth_errors
from palpate.benchmark.motion_truth import force_errors, pressed_nodes
from palpate.benchmark.richardson import limit
from palpate.studies.dynamic.compared_scene import ComparedScene

FELT = 0.2
"""Largest own error of the limit's force, over its peak, with which models are judged by their forces."""


@dataclass(frozen=True, eq=False)
class LinearLimit:
    """How well a motion of linear elements is known, from what another mesh and another step change.

    levels : number of meshes; steps : number of the longer ones
    until_s : time up to which surface and pressed nodes are known to ``part`` of the peak
    own : (4, k), the k TruthErrors of space, of time, of their mixture, and together; own_force : of the force, RMS
        over its peak, NaN where nothing touches; both up to ``until_s``, or of the whole motion where that is 0
    peaks_m : (3,) largest displacement on the last two meshes, and on the last in the shorter steps
    spent_s : time of all motions [s]
    """

    levels: int
    steps: int
    until_s: float
    part: float
    own: np.ndarray
    own_force: float
    peaks_m: np.ndarray
    spent_s: float

    @property
    def said(self) -> str:
        """In words, up to when models are judged by it."""
        until = f"until {self.until_s:.3g} s and no longer" if self.until_s else "at no time"
        return (
            f"linear elements alone, of which two meshes and two steps agree to {self.part:.2g} of the peak {until}; "
            f"{self.peaks}"
        )

    @property
    def peaks(self) -> str:
        """In words, the largest displacement on the last two meshes and in both steps."""
        before, last, shorter = (f"{1e3 * peak:.3g}" for peak in self.peaks_m)
        return (
            f"largest displacement {before} mm on the mesh before the last, {last} mm on the last, {shorter} mm there "
            "in the shorter steps"
        )

    def described(self, level: int) -> dict[str, Any]:
        """Return what is known of a standard on ``level``, as columns of dynamic_accuracy.csv.

        Its error is what the limit may be wrong by, and on the mesh before the last by how far that is from the last.
        Of the force nothing is known where the limit may be wrong by more than FELT.
        """
        if not self.until_s:
            return {"parted": f"two meshes agree at no time: {self.peaks}"}
        space, *_, all_together = self.own[:, TruthErrors._fields.index("rmse_of_peak")]
        mesh_error = {self.levels - 1: 0.0, self.levels - 2: space}.get(level, np.nan)
        force = self.own_force if self.own_force <= FELT else np.nan
        return {"reference_error": float(all_together + mesh_error), "reference_force_error": force}


def linear_limit(compared: ComparedScene, count: int, part: float, progress: Callable = iter) -> LinearLimit:
    """Simulate ``compared`` on all levels, in ``count`` and twice as many steps a frame; say how far these agree.

    part : of the peak, by which meshes and steps together may differ in a frame, at the surface and where it is pressed
    progress : wraps the sequence of motions, as ``tqdm`` does; NotConverged as ``run``
    """
    last, rate = len(compared.body.levels) - 1, 2.0**compared.order
    motions, forces_of, spent_s = {}, {}, 0.0
    for level, a_frame in progress([(level, a_frame) for level in range(last + 1) for a_frame in (count, 2 * count)]):
        motions[level, a_frame], run = compared.move(compared.fem(a_frame * compared.frames), level)
        forces_of[level, a_frame], spent_s = run.motion.instrument_forces(), spent_s + run.seconds
    (coarser, finest), (_, force) = (_limits(each, last, count, rate) for each in (motions, forces_of))
    space, time = finest - coarser, finest - motions[last, 2 * count]
    mixed = time - (coarser - motions[last - 1, 2 * count])
    patch = np.tile(pressed_nodes(compared.body, compared.loads), 1 + len(compared.shifts_m))
    peaks, changes = np.linalg.norm(finest, axis=2).max(axis=1), (space, time, mixed)
    resolved = min(
        resolved_frames(_rms(each[:, nodes] for each in changes), peaks, part) for nodes in (patch, ~patch | patch)
    )
    resolved = resolved if peaks[:resolved].any() else 0
    frames = slice(resolved or compared.frames)

    def size(change: np.ndarray) -> np.ndarray:
        truth = finest[frames].reshape(-1, 3)
        return np.array(truth_errors(truth + change[frames].reshape(-1, 3), truth, np.tile(patch, len(finest[frames]))))

    own_parts = np.array([size(change) for change in changes])
    forces = _limits(forces_of, last, count, rate)[0], forces_of[last, 2 * count]
    own_force = np.linalg.norm([force_errors(each[frames], force[frames]).force_rms_of_peak for each in forces])
    largest = np.array([np.linalg.norm(each, axis=2).max() for each in (coarser, finest, motions[last, 2 * count])])
    until_s = compared.duration_s * resolved / compared.frames
    own_errors = np.vstack([own_parts, np.sqrt(np.sum(own_parts**2, axis=0))])
    return LinearLimit(1 + last, count * compared.frames, until_s, part, own_errors, float(own_force), largest, spent_s)


def resolved_frames(off: np.ndarray, peaks: np.ndarray, change: float) -> int:
    """Return how many frames from the first on differ by at most ``change`` of the peak until then.

    off : (f,) [m] RMSE of each frame; peaks : (f,) [m], the largest displacement in each
    """
    small = np.maximum.accumulate(off) <= change * np.maximum.accumulate(peaks)
    return int(np.flatnonzero(small)[-1]) + 1 if small.any() else 0


def _limits(motions: dict, last: int, count: int, rate: float) -> list[np.ndarray]:
    """Extrapolate ``motions``, by level and steps a frame, on the last two levels each to steps of no length."""
    return [limit(np.array([motions[level, count], motions[level, 2 * count]]), rate) for level in (last - 1, last)]


def _rms(changes: Iterable[np.ndarray]) -> np.ndarray:
    """Return the RMS (f,) over nodes of what differs together, each (f, n, 3)."""
    return np.sqrt(sum(np.mean(np.sum(change**2, axis=2), axis=1) for change in changes))
