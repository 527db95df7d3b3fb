"""Find the truth of touches by instruments: the limit of quadratic elements that are refined at the contact.

Elements are halved along two axes, on three meshes each: where they are touched, and at the rim of what is held with
all others, since the two errors shrink at different rates. The limit is that of both axes (richardson.py), the
displacement and each number by itself. Its own error is the sum of those of both axes and of their mixture. Models are
evaluated against the truth, and never see it.
"""

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from palpate.benchmark.richardson import CROSS, limit_over, rejection
from palpate.benchmark.settings import TouchTruthSettings
from palpate.benchmark.touch import Touch, Touched, TouchErrors, TouchTruth, patch_of, touch_errors
from palpate.benchmark.touch_mesh import TOLERANCE, TouchedMeshes, answer_of
from palpate.benchmark.truth import columns_of, warn_of_rejected
from palpate.bodies.body import Body
from palpate.errors import InputError, NotConverged

MOST_OVERLAP = 2e-3
"""Mean overlap over the depth above which the finest answer is none of this instrument."""
LEAST_DET = 0.1
"""Smallest det F at any point of integration of the finest elements; below, the law is no tissue's."""


USUAL = TouchTruthSettings()


FIRST_MB, NODE_MB = 250.0, 0.0115
"""Memory [MB] that a truth takes whatever its meshes, and besides for each node of the largest one: 900 MB in all for
the 57 thousand of the liver under a ball of 8 mm."""


def truth_of_touches(
    body: Body,
    touches: Sequence[Touch],
    progress: Callable = iter,
    settings: TouchTruthSettings = USUAL,
    say: Callable[[str], None] | None = None,
    free_mb: float = np.inf,
) -> TouchTruth:
    """Find the truth of each touch; warns of those that are rejected.

    progress : wraps their sequence, as ``tqdm`` does
    say : receives a sentence on the size of the largest mesh, before any is made
    free_mb : free memory [MB]; InputError if the largest mesh needs more
    """
    meshes, rows = TouchedMeshes(body), []
    nodes, tetrahedra = max(_largest(meshes, touch, settings) for touch in touches)
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
        rows.append(_truth(body, meshes, touch, settings) | {"seconds": perf_counter() - begin})
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


def _levels(meshes: TouchedMeshes, touch: Touch, settings: TouchTruthSettings) -> tuple[list[int], list[int]]:
    """Return three levels at the rim of what is held, and three where it is touched; NotConverged beyond the finest."""
    level = max(meshes.level_for(touch, settings.along_radius), 2)
    return [max(0, settings.finest - back) for back in (2, 1, 0)], [level - back for back in (2, 1, 0)]


def _largest(meshes: TouchedMeshes, touch: Touch, settings: TouchTruthSettings) -> tuple[int, int]:
    """Estimate the nodes and tetrahedra of the largest mesh of a truth; none where there can be no truth."""
    try:
        rims, contacts = _levels(meshes, touch, settings)
    except NotConverged:
        return 0, 0
    return max(meshes.size(touch, rims[1], contacts[2]), meshes.size(touch, rims[2], contacts[1]))


def _truth(body: Body, meshes: TouchedMeshes, touch: Touch, settings: TouchTruthSettings) -> dict[str, Any]:
    """Find the truth of one touch; return the values of the fields of ``TouchTruth`` but sample and seconds."""
    answers: dict[tuple[int, int], _Answer] = {}
    nodes = 0
    try:
        rims, contacts = _levels(meshes, touch, settings)
        for at_contact, at_rim in CROSS:
            mesh = meshes.around(touch, rims[at_rim], contacts[at_contact])
            state_before, state = mesh.problem.push(touch.direction, [touch.before.depth_m, touch.depth_m], TOLERANCE)
            answer = answer_of(mesh.problem, state, touch, mesh.up)
            slope = float((state.force - state_before.force) @ touch.direction)
            answers[at_contact, at_rim] = _Answer(answer.displacement, answer.force_n, slope, answer.area_m2)
            nodes = max(nodes, len(state.x))
    except (NotConverged, InputError) as failure:
        missing = dict.fromkeys(("area", "pressure", "order", "force_order", "overlap", "least_det", "edge_m"), np.nan)
        count = len(body.fine.surface)
        no_fields = {"displacement": np.full((count, 3), np.nan), "force": np.full(2, np.nan), "nodes": 0}
        no_errors = np.full(len(TouchErrors._fields), np.nan)
        return missing | no_fields | {"own": no_errors, "rejected": f"no answer on a mesh ({failure})"}
    patch = patch_of(body, touch)

    def errors(wrong: _Answer, truth: _Answer) -> TouchErrors:
        return touch_errors(wrong.touched, truth.touched, patch, wrong.slope / truth.slope - 1.0)

    limit = limit_over(answers, (1, 1), (None, None))
    truth, least_det = limit.answer, mesh.problem.least_det(state.x)
    own_error = TouchErrors(*limit.own(errors).sum(axis=0))
    return {
        "displacement": truth.displacement,
        "force": np.array([truth.force - truth.slope, truth.force]),
        "area": truth.area,
        "pressure": state.pressure_pa,
        "own": own_error,
        "order": _order(limit.ratios[1].displacement),
        "force_order": _order(limit.ratios[0].force),
        "overlap": state.overlap,
        "least_det": least_det,
        "nodes": nodes,
        "edge_m": mesh.edge_m,
        "rejected": rejection(
            (
                own_error.force_error <= settings.most_force_error and own_error.rmse_of_peak <= settings.most_error,
                f"the meshes are too far apart (own error of the force {own_error.force_error:.1%}, of the surface "
                f"{own_error.rmse_of_peak:.1%})",
            ),
            (state.overlap <= MOST_OVERLAP, f"the instrument overlaps ({state.overlap:.1%} of the depth)"),
            (least_det >= LEAST_DET, f"an element is squeezed flat (det F {least_det:.2g})"),
        ),
    }


def _order(rate: float) -> float:
    """Return the order of convergence by a ratio of changes, NaN where the change has turned."""
    return float(np.log2(rate)) if rate > 0.0 else np.nan
