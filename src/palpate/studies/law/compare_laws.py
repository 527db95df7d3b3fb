"""Press a body under each law, and set what the choice of the law changes beside the error of the mesh.

Both are found on the same nested levels of quadratic elements. What a law changes is its answer minus that of the body
as it is described, on the finest level of both, where the errors of the mesh cancel. What the mesh costs is the answer
on a coarser level minus the limit of all levels, for each law by itself.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import OWN as ERRORS
from palpate.benchmark.accuracy import Truth, peak_of, truth_errors, truth_levels
from palpate.benchmark.presses import FORCES, Sample, choose_presses, samples_in
from palpate.benchmark.truth import truth_of
from palpate.bodies import body_file
from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_near_regions
from palpate.bodies.material import Material, Tissue
from palpate.effects.elements import locking_is_measured
from palpate.errors import NotConverged
from palpate.run.job import steps
from palpate.solvers.equilibrium import Equilibrium
from palpate.table_declaration import Table

OWN, LAW, POISSON, REGIONS = "nothing", "law", "poisson", "regions"
"""What differs from the body as it is described."""
MESHES = ("linear", "quadratic", "finest")
"""Meshes whose errors are measured: linear elements on the finest level, quadratic ones of the same nodes and on it."""


class Variant(NamedTuple):
    """A body, and which of its properties is ``changed``: one of OWN, LAW, POISSON and REGIONS."""

    changed: str
    body: Body


def variants(body: Body, laws: Sequence[str], poissons: Sequence[float]) -> list[Variant]:
    """Return the body as it is described, and variants of it with one property changed.

    laws, poissons : values that are tried; those that the body has already give no variant
    A body with regions also has a variant without them, of its own material alone.
    """
    listed = [Variant(OWN, body)]
    listed += [Variant(LAW, _changed(body, law=law)) for law in laws if law != body.material.law]
    materials: list[Material] = [body.material, *(body.regions.materials if body.regions is not None else ())]
    for poisson in poissons:
        if any(each.poisson != poisson for each in materials):
            listed.append(Variant(POISSON, _changed(body, poisson=poisson)))
    if body.regions is not None:
        listed.append(Variant(REGIONS, replace(body, regions=None)))
    return listed


def _changed(body: Body, **change: Any) -> Body:
    """Return ``body`` with fields ``change`` of every material replaced."""
    regions = body.regions
    if regions is not None:
        regions = Tissue([replace(each, **change) for each in regions.materials], regions.region)
    return replace(body, material=replace(body.material, **change), regions=regions)


TOLERANCE = 1e-3
"""Relative residual on every level but the first; 1e-4 moves no change of a law by more than a fiftieth of it."""
LAW_TABLE = Table(
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
    """Press each of the ``variants`` of ``body`` by every row of ``loads``, and tabulate LAW_TABLE.

    loads : as of ``choose_presses``; progress : wraps the list of variants, as ``tqdm`` does
    Errors of the MESHES are against the truth of the variant that is ``tried``, changes from the ``original`` truth.
    A press without an answer under a law has no numbers, and the column ``why`` says the reason.
    """
    rows: list[dict] = []
    samples, original = samples_in(loads), None
    for tried in progress(variants(body, laws, poissons)):
        with warnings.catch_warnings():  # the table says which presses have no truth, instead
            warnings.filterwarnings("ignore", ".*presses have no truth")
            truth = truth_of(tried.body, samples, (), tolerance=tolerance)
        linear = _linear(tried.body, samples, tolerance)
        original = original or truth  # the first that is tried is the body as it is described
        material = tried.body.material
        labels = {"body": tried.body.name, "changed": tried.changed, "law": material.law, "poisson": material.poisson}
        for i, (sample, depth) in enumerate(zip(samples, loads["peak_of_size"], strict=True)):
            contact, force = sample.load.single()
            pressed = {"contact": contact, "force_n": float(np.linalg.norm(force)), "depth_of_size": float(depth)}
            rows.append(labels | pressed | _numbers(tried.body, truth, original, linear[i], i, sample))
    return LAW_TABLE.frame(rows)


def _linear(body: Body, samples: Sequence[Sample], tolerance: float) -> list[np.ndarray | None]:
    """Return the answers (n, 3) [m] of linear elements on the finest level; None where there is none."""
    level = len(body.levels) - 1
    answers: list[np.ndarray | None] = []
    with locking_is_measured():
        problem = Equilibrium(body, level)
    for sample in samples:
        try:
            moved = problem.solve(sample.nodal(body, level), tolerance).x - problem.mesh.nodes
        except NotConverged:
            answers.append(None)
        else:
            answers.append(moved[body.fine.surface])
    return answers


def _numbers(body: Body, truth: Truth, original: Truth, linear: np.ndarray | None, i: int, sample: Sample) -> dict:
    """Return the errors and changes of press ``i`` of a variant; original : truth of the body as it is described."""
    levels, original_levels = _answered(truth, i), _answered(original, i)
    row = {"why": truth.rejected[i], "believed": bool(truth.believed[i])}
    if original_levels:
        row |= {"depth_of_size": peak_of(original.displacement[i]) / body.fine.size}
    if not levels:
        return row
    limit, finest = truth.displacement[i], len(body.levels) - 1 - truth_levels(body)[0]
    pairs = {"quadratic": (levels[max(finest - 1, 0)], limit)}
    if not np.array_equal(limit, levels[finest]):  # it is where the levels have no limit that can be seen
        pairs |= {"finest": (levels[finest], limit)}
    pairs |= {"change": (levels[-1], original_levels[-1])} if original_levels else {}
    pairs |= {"linear": (linear, limit)} if linear is not None else {}
    patch = sample.pressed(body)
    for kind, (computed, reference) in pairs.items():
        errors = truth_errors(computed, reference, patch)
        row |= {
            f"{kind}_{name}": getattr(errors, name) for name in ("rmse_of_peak", "relative_l2", "patch_rms_of_peak")
        }
    row |= {"peak_of_size": peak_of(limit) / body.fine.size}
    row |= {"own_rmse_of_peak": truth.own[i, ERRORS.index("rmse_of_peak")]}
    row |= {"volume_change": truth.volume_change[i], "least_det": truth.least_det[i]}
    return row | {"iterations": truth.iterations[i], "cycles": truth.products[i]}


def _answered(truth: Truth, i: int) -> list[np.ndarray]:
    """Return the answers (n, 3) [m] of press ``i`` on all levels, coarse first; empty if there is no limit."""
    if not np.isfinite(truth.displacement[i]).all():
        return []
    return [level for level in truth.levels[i] if np.isfinite(level).all()]


def growing_presses(
    body: Body, contacts: int, depths: Sequence[float], radius_m: float, progress: Callable = iter
) -> pd.DataFrame:
    """Choose presses along the inward normal to each of ``depths``, at each of ``contacts`` contacts.

    A body with regions is also pressed at the contact nearest to one of them; ``contacts`` may then be 0.
    depths : largest displacements over the body's size; radius_m : of the disc that is pressed [m]
    Returns the table of ``choose_presses``, and warns and raises as it does. Where the trade-off's limit of pressure
    allows no deeper press of a contact, its deepest press has that pressure.
    """
    deepest = max(depths)
    above_regions = [] if body.regions is None else contacts_near_regions(body, 1)[0][:1].tolist()
    presses = [{"magnitude": depth / deepest, "tilt_degrees": 0} for depth in sorted(depths)]
    table = choose_presses(body, contacts, presses, {"peak_of_size": deepest}, radius_m, 1, progress, above_regions)
    return table[~table[["contact", *FORCES]].round(12).duplicated()].reset_index(drop=True)


VARIANT = ["body", "changed", "law", "poisson"]


def from_depths(table: pd.DataFrame) -> pd.DataFrame:
    """Tabulate, from law.csv, the depth from which on a variant changes the answer by more than the error of each mesh.

    Returns a row for each VARIANT, ``contact`` and ``mesh``; ``from_depth`` is over the body's size, 0 if the change is
    larger at all depths, infinite if it is not at the largest. The mesh's error is that of the variant against its own
    truth, where that is believed; for the mesh "own" it is that of the truth itself.
    """
    rows = []
    changed = table[(table["changed"] != OWN) & table["change_rmse_of_peak"].notna() & table["believed"].astype(bool)]
    for (*variant, contact), curve in changed.groupby([*VARIANT, "contact"], sort=False):
        for mesh in (*MESHES, "own"):
            with_error = curve[curve[f"{mesh}_rmse_of_peak"].notna()].sort_values("depth_of_size")
            if len(with_error):
                ratio = with_error["change_rmse_of_peak"] / with_error[f"{mesh}_rmse_of_peak"]
                depth = crossing(with_error["depth_of_size"].to_numpy(), ratio.to_numpy())
                rows.append([*variant, contact, mesh, depth])
    return pd.DataFrame(rows, columns=[*VARIANT, "contact", "mesh", "from_depth"])


def crossing(depth: np.ndarray, ratio: np.ndarray) -> float:
    """Return the depth from which on ``ratio`` (k,) stays above 1, over increasing ``depth`` (k,).

    Between two depths it is interpolated as a power of the depth. Returns 0 if it is above 1 at all depths, and
    infinity if it is not at the last one.
    """
    not_above = np.flatnonzero(~(ratio > 1.0))
    if not len(not_above):
        return 0.0
    i = int(not_above[-1])
    if i == len(depth) - 1:
        return float("inf")
    log_depth, log_ratio = np.log(depth[i : i + 2]), np.log(np.maximum(ratio[i : i + 2], np.finfo(float).tiny))
    return float(np.exp(log_depth[0] - log_ratio[0] * (log_depth[1] - log_depth[0]) / (log_ratio[1] - log_ratio[0])))


def press_under_laws(
    input: Any,
    say: Callable,
    laws: list[str],
    poissons: list[float],
    contacts: int,
    depths: list[float],
    radius_m: float,
) -> dict[str, pd.DataFrame]:
    """Compare the laws of one body, for the rule compare_laws."""
    body = body_file.load(input.body)
    choosing = steps(say, f"{body.name}: forces of growing presses at contact")
    loads = growing_presses(body, contacts, depths, radius_m, choosing)
    pressing = steps(say, f"{body.name}: presses under each law, variant")
    return {"table": compare_laws(body, loads, laws, poissons, pressing)}
