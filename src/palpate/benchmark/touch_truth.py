"""Find the truth of touches by instruments: the limit of quadratic elements that are refined at the contact.

Elements are halved along two axes, on three meshes each: where they are touched, and at the rim of what is held with
all others, since the two errors shrink at different rates. The limit is that of both axes (richardson.py), the
displacement and each number by itself. Its own error is the sum of those of both axes and of their mixture. Models are
evaluated against the truth, and never see it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from palpate.benchmark.accuracy import patch_nodes, truth_errors
from palpate.benchmark.richardson import CROSS, limit_over, rejection
from palpate.benchmark.settings import TouchTruthSettings
from palpate.benchmark.touch import Touch, Touched
from palpate.benchmark.touch_mesh import TOLERANCE, TouchedMeshes, answer_of
from palpate.benchmark.truth import columns_of, warn_of_rejected
from palpate.bodies.body import Body
from palpate.errors import InputError, NotConverged

MOST_OVERLAP = 2e-3
"""Mean overlap over the depth above which the finest answer is none of this instrument."""
LEAST_DET = 0.1
"""Smallest det F at any point of integration of the finest elements; below, the law is no tissue's."""


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
    moved = truth_errors(answer.displacement, truth.displacement, patch)
    force, area = answer.force_n / truth.force_n - 1.0, answer.area_m2 / truth.area_m2 - 1.0
    surface = moved.rmse_of_peak, moved.patch_rms_of_peak, moved.patch_max_of_peak, moved.max_of_peak
    return TouchErrors(*surface, float(force), stiffness_error, float(area))


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


USUAL = TouchTruthSettings()


FIRST_MB, NODE_MB = 250.0, 0.0115
"""Memory [MB] that a truth takes whatever its meshes, and besides for each node of the largest one: 900 MB in all for
the 57 thousand of the liver under a ball of 8 mm."""


def truth_of_touches(
    body: Body,
    touches: Sequence[Touch],
    progress: Callable = iter,
    asked: TouchTruthSettings = USUAL,
    say: Callable[[str], None] | None = None,
    free_mb: float = np.inf,
) -> TouchTruth:
    """Find the truth of each touch; warns of those that are rejected.

    progress : wraps their sequence, as ``tqdm`` does
    say : receives a sentence on the size of the largest mesh, before any is made
    free_mb : free memory [MB]; InputError if the largest mesh needs more
    """
    meshes, rows = TouchedMeshes(body), []
    nodes, tetrahedra = max(_largest(meshes, touch, asked) for touch in touches)
    needed_mb, place = FIRST_MB + NODE_MB * nodes, f"{body.name}, {touches[0].instrument.name}"
    size = f"the largest mesh of the truth has about {nodes} nodes in {tetrahedra} tetrahedra and takes"
    if say is not None:
        say(f"{place}: {size} {needed_mb / 1e3:.1f} GB of memory")
    if needed_mb > free_mb:
        raise InputError(
            f"bodies.{place}: {size} {needed_mb / 1e3:.1f} GB of memory, of which {free_mb / 1e3:.1f} GB are free; "
            "give the body fewer refinements or surface_nodes, lower touch.truth.finest, or take a smaller instrument."
        )
    for touch in progress(touches):
        begin = perf_counter()
        rows.append(_truth(body, meshes, touch, asked) | {"seconds": perf_counter() - begin})
    truth = TouchTruth(sample=np.arange(len(rows)), **columns_of(rows))
    warn_of_rejected(f"{body.name}, {touches[0].instrument.name}", "touches", truth.rejected, "they judge no model.")
    return truth


class _Answer(NamedTuple):
    """The answer of one mesh: displacement (n, 3) [m], force [N], its ``slope``, area [m²].

    slope : increase of the force over the last part of the depth [N]
    """

    displacement: np.ndarray
    force: float
    slope: float
    area: float

    @property
    def touched(self) -> Touched:
        return Touched(self.displacement, self.force, self.area)


def _levels(meshes: TouchedMeshes, touch: Touch, asked: TouchTruthSettings) -> tuple[list[int], list[int]]:
    """Return three levels at the rim of what is held, and three where it is touched; NotConverged beyond the finest."""
    level = max(meshes.level_for(touch, asked.along_radius), 2)
    return [max(0, asked.finest - back) for back in (2, 1, 0)], [level - back for back in (2, 1, 0)]


def _largest(meshes: TouchedMeshes, touch: Touch, asked: TouchTruthSettings) -> tuple[int, int]:
    """Estimate the nodes and tetrahedra of the largest mesh of a truth; none where there can be no truth."""
    try:
        rims, where = _levels(meshes, touch, asked)
    except NotConverged:
        return 0, 0
    return max(meshes.size(touch, rims[1], where[2]), meshes.size(touch, rims[2], where[1]))


def _truth(body: Body, meshes: TouchedMeshes, touch: Touch, asked: TouchTruthSettings) -> dict[str, Any]:
    """Find the truth of one touch; return the values of the fields of ``TouchTruth`` but sample and seconds."""
    answers: dict[tuple[int, int], _Answer] = {}
    nodes = 0
    try:
        rims, where = _levels(meshes, touch, asked)
        for near, rim in CROSS:
            mesh = meshes.around(touch, rims[rim], where[near])
            before, state = mesh.problem.push(touch.direction, [touch.before.depth_m, touch.depth_m], TOLERANCE)
            answer = answer_of(mesh.problem, state, touch, mesh.up)
            slope = float((state.force - before.force) @ touch.direction)
            answers[near, rim] = _Answer(answer.displacement, answer.force_n, slope, answer.area_m2)
            nodes = max(nodes, len(state.x))
    except (NotConverged, InputError) as failure:
        nothing = dict.fromkeys(("area", "pressure", "order", "force_order", "overlap", "least_det", "edge_m"), np.nan)
        count = len(body.fine.surface)
        shape = {"displacement": np.full((count, 3), np.nan), "force": np.full(2, np.nan), "nodes": 0}
        own = np.full(len(TouchErrors._fields), np.nan)
        return nothing | shape | {"own": own, "rejected": f"no answer on a mesh ({failure})"}
    patch = patch_of(body, touch)

    def errors(wrong: _Answer, truth: _Answer) -> TouchErrors:
        return touch_errors(wrong.touched, truth.touched, patch, wrong.slope / truth.slope - 1.0)

    limit = limit_over(answers, (1, 1), (None, None))
    truth, least = limit.answer, mesh.problem.least_det(state.x)
    may_be = TouchErrors(*limit.own(errors).sum(axis=0))
    return {
        "displacement": truth.displacement,
        "force": np.array([truth.force - truth.slope, truth.force]),
        "area": truth.area,
        "pressure": state.pressure_pa,
        "own": may_be,
        "order": _order(limit.ratios[1].displacement),
        "force_order": _order(limit.ratios[0].force),
        "overlap": state.overlap,
        "least_det": least,
        "nodes": nodes,
        "edge_m": mesh.edge_m,
        "rejected": rejection(
            (
                may_be.force_error <= asked.most_force_error and may_be.rmse_of_peak <= asked.most_error,
                f"the meshes are too far apart (own error of the force {may_be.force_error:.1%}, of the surface "
                f"{may_be.rmse_of_peak:.1%})",
            ),
            (state.overlap <= MOST_OVERLAP, f"the instrument overlaps ({state.overlap:.1%} of the depth)"),
            (least >= LEAST_DET, f"an element is squeezed flat (det F {least:.2g})"),
        ),
    }


def _order(rate: float) -> float:
    """Return the order of convergence by a ratio of changes, NaN where the change has turned."""
    return float(np.log2(rate)) if rate > 0.0 else np.nan
