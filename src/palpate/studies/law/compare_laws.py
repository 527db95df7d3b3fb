"""Press a body under each law, and set what the choice of the law changes beside the error of the mesh.

Both are found on the same nested levels of quadratic elements. What a law changes is its answer minus that of the body
as it is described, on the finest level of both, where the errors of the mesh cancel. What the mesh costs is the answer
on a coarser level minus the limit of all levels, for each law by itself.
"""

import warnings
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import patch_nodes, truth_errors
from palpate.benchmark.loads import force_of, nodal_forces
from palpate.benchmark.nested_levels import truth_levels
from palpate.benchmark.truth import OWN as ERRORS
from palpate.benchmark.truth import Truth, truth_of
from palpate.bodies.body import Body
from palpate.effects.locking import locking_is_measured
from palpate.errors import NotConverged
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.law.variants import Variant, variants
from palpate.table import Table

TOLERANCE = 1e-3
"""Relative residual on every level but the first; 1e-4 moves no change of a law by more than a fiftieth of it."""
MEASURES = ("rmse_of_peak", "relative_l2", "patch_rms_of_peak")
"""The errors of TruthErrors that are tabulated."""
LAW = Table(
    "law",
    "The same presses under each law: what it changes, beside the errors of three meshes against its own truth.",
    """
    body changed law poisson: a body, what differs from it as it is described, its law and Poisson's ratio
    contact force_n: node that is pressed, and the force on its disc [N]
    depth_of_size peak_of_size: largest displacement of the body as it is described, and of this one [body's size]
    change_rmse_of_peak change_relative_l2 change_patch_rms_of_peak: distance from the answer of the body as it is
    linear_rmse_of_peak linear_relative_l2 linear_patch_rms_of_peak: error of linear elements on the finest level
    quadratic_rmse_of_peak quadratic_relative_l2 quadratic_patch_rms_of_peak: of quadratic ones with the same nodes
    finest_rmse_of_peak finest_relative_l2 finest_patch_rms_of_peak: of quadratic ones on the finest level
    own_rmse_of_peak: error of this body's own truth
    volume_change least_det: change of the body's volume / volume, and least determinant of F
    iterations cycles: iterations of Newton's method and multigrid cycles, over all levels
    believed why: whether there is a truth that is believed, and why there is no answer
    """,
)


def compare_laws(
    body: Body,
    loads: pd.DataFrame,
    laws: Sequence[str],
    poissons: Sequence[float],
    progress: Callable = iter,
    tolerance: float = TOLERANCE,
) -> pd.DataFrame:
    """Press ``body``, and each of its ``variants`` with ``laws`` and ``poissons``, by every row of ``loads``.

    loads : as ``choose_presses`` gives them; progress : wraps the sequence of variants, as ``tqdm`` does
    Returns a row for each variant and load: ``changed`` says what differs from the body as it is
    described, ``change_…`` how far its answer is from that one; ``linear_…``, ``quadratic_…`` and ``finest_…`` are the
    errors of the MESHES, against that variant's own limit, whose error is ``own_…``. ``depth_of_size`` is the peak of
    the body as it is described, ``peak_of_size`` that of the changed one. A press without an answer under a law has no
    numbers of its own, and says ``why``.
    """
    found: list[tuple[Variant, Truth]] = []
    rows = []
    for each in progress(variants(body, laws, poissons)):
        found.append((each, _truth(each.body, loads, tolerance)))
        linear = _linear(each.body, loads, tolerance)
        for i, (_, load) in enumerate(loads.iterrows()):
            rows.append(_labels(each, load) | _numbers(*found[-1], found[0][1], linear[i], i, load))
    return LAW.frame(rows)


def _truth(body: Body, loads: pd.DataFrame, tolerance: float) -> Truth:
    """Find the limits on the first three levels; the table says which presses have none, instead of a warning."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*presses have no truth")
        return truth_of(body, loads, (), tolerance=tolerance)


def _linear(body: Body, loads: pd.DataFrame, tolerance: float) -> list[np.ndarray | None]:
    """Return the answers (n, 3) [m] of linear elements on the finest level; None where there is none."""
    level = len(body.levels) - 1
    answers: list[np.ndarray | None] = []
    with locking_is_measured():
        problem = Equilibrium(body, level)
    for _, load in loads.iterrows():
        try:
            moved = problem.solve(nodal_forces(body, level, load), tolerance).x - problem.mesh.nodes
        except NotConverged:
            answers.append(None)
        else:
            answers.append(moved[body.fine.surface])
    return answers


def _labels(each: Variant, load: pd.Series) -> dict:
    """Name a press of a variant."""
    material = each.body.material
    row = {"body": each.body.name, "changed": each.changed, "law": material.law, "poisson": material.poisson}
    return row | {"contact": int(load["contact"]), "force_n": float(np.linalg.norm(force_of(load)))}


def _numbers(each: Variant, truth: Truth, own: Truth, linear: np.ndarray | None, i: int, load: pd.Series) -> dict:
    """Measure press ``i`` of one variant; ``own`` is the truth of the body as it is described."""
    body, levels, before = each.body, _answered(truth, i), _answered(own, i)
    row = {"why": truth.rejected[i], "believed": bool(truth.believed[i]), "depth_of_size": float(load["peak_of_size"])}
    if before:
        row |= {"depth_of_size": _peak(own.displacement[i]) / body.fine.size}
    if not levels:
        return row
    limit, finest = truth.displacement[i], len(body.levels) - 1 - truth_levels(body)[0]
    pairs = {"quadratic": (levels[max(finest - 1, 0)], limit)}
    if not np.array_equal(limit, levels[finest]):  # it is where the levels have no limit that can be seen
        pairs |= {"finest": (levels[finest], limit)}
    pairs |= {"change": (levels[-1], before[-1])} if before else {}
    pairs |= {"linear": (linear, limit)} if linear is not None else {}
    patch = patch_nodes(body.fine, int(load["contact"]), float(load["radius_m"]))
    for kind, (found, truly) in pairs.items():
        errors = truth_errors(found, truly, patch)
        row |= {f"{kind}_{name}": getattr(errors, name) for name in MEASURES}
    row |= {
        "peak_of_size": _peak(limit) / body.fine.size,
        "own_rmse_of_peak": truth.own[i, ERRORS.index("rmse_of_peak")],
    }
    row |= {"volume_change": truth.volume_change[i], "least_det": truth.least_det[i]}
    return row | {"iterations": truth.iterations[i], "cycles": truth.products[i]}


def _answered(truth: Truth, i: int) -> list[np.ndarray]:
    """Return the answers (n, 3) [m] of the levels of press ``i``, coarse first; none if one of them failed."""
    if not np.isfinite(truth.displacement[i]).all():
        return []
    return [level for level in truth.levels[i] if np.isfinite(level).all()]


def _peak(displacement: np.ndarray) -> float:
    return float(np.linalg.norm(displacement, axis=1).max())
