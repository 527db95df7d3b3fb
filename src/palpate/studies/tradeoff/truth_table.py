"""Tabulate how exactly truths are known, check them by another element and a smooth surface, and find limit points.

Beyond a limit point of the law a body snaps to another shape: no answer is nearby, so that meshes disagree, models
cannot follow, and there is no truth. Presses of the trade-off stay below them: by their peak pressure, and where that
is not enough, as they are lowered where an element is squeezed to half or the body collapses.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import OWN, Truth, TruthErrors, truth_errors, truth_levels
from palpate.benchmark.presses import Sample, check_radius
from palpate.benchmark.ranking import KINDS
from palpate.benchmark.richardson import limit, ratio
from palpate.benchmark.truth import FIRST, NEXT, SQUEEZED, ascend, over, reasons
from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, kept_contacts, row_of
from palpate.bodies.organs import SmoothSurface
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import nodal_load
from palpate.errors import NotConverged
from palpate.solvers.equilibrium import Equilibrium
from palpate.table_declaration import Table

TRUTH = Table(
    "truth",
    "How exactly the truth of each scene is known, the mesh and time that it takes, and what volume the body loses.",
    """
    scene radius_m samples rejected: a scene, the disc's radius [m], test samples, and those without a truth
    elements level nodes inverted: the finest mesh, and the samples with an element inside out
    rmse_of_peak relative_l2 patch_rms_of_peak order: means of the truth's own errors, and the order of convergence
    rmse_of_peak_max relative_l2_max patch_rms_of_peak_max: its greatest errors
    ratio_min ratio_max: between which the ratios of successive changes lie
    least_det squeezed volume_change: least determinant of F, samples below a half, and change of volume / volume
    iterations cycles seconds: of a sample, the mean iterations and multigrid cycles and the median time [s]
    validation_samples validation_rmse_of_peak validation_patch_rms_of_peak: samples that choose settings and do without
        the finest mesh, and means of their truth's own errors
    validation_rmse_of_peak_max validation_patch_rms_of_peak_max: the greatest of these
    other_element other_element_patch other_element_samples: distance of linear elements' limit, on so many samples
    other_element_own other_element_own_patch: the truth's own errors on these
    geometry_of_peak geometry_patch_of_peak geometry_samples: what the facets change against the smooth shape
    why_rejected: the reasons, with their counts
    """,
)
_MEANS = ("rmse_of_peak", "relative_l2", "patch_rms_of_peak")


def truth_row(
    scene: str, truth: Truth, other: pd.DataFrame | None = None, geometry: pd.DataFrame | None = None
) -> dict:
    """Return the row of TRUTH of one scene: means and maxima of the truth's own errors over samples that are believed.

    Only samples that were answered on the finest level count there; those that only choose settings may do without it,
    and have columns of their own. Extreme ratios and determinants are of all samples, rejected ones too.
    other : rows of ``other_element``; geometry : rows of ``geometry_share``; or None where these were not tried
    """
    finest = truth.believed & np.isfinite(truth.levels[:, -1]).all(axis=(1, 2))
    coarser = truth.believed & ~finest & np.isfinite(truth.displacement).all(axis=(1, 2))
    row: dict = {"scene": scene, "samples": int(finest.sum()), "rejected": int((~truth.believed).sum())}
    row |= _counted(truth, finest) | _own(truth, finest, _MEANS) | _own(truth, coarser, KINDS.values(), "validation_")
    row |= {"validation_samples": int(coarser.sum())}
    if other is not None and len(other):
        own = _own(truth, np.isin(truth.sample, other["sample"]), _MEANS)
        row |= _means(other, "other_element", "other_element_patch")
        row |= {"other_element_own": own["rmse_of_peak"], "other_element_own_patch": own["patch_rms_of_peak"]}
    if geometry is not None and len(geometry):
        row |= _means(geometry, "geometry_of_peak", "geometry_patch_of_peak")
    return row | {"why_rejected": "; ".join(f"{count} {why}" for why, count in reasons(truth.rejected).items())}


def _counted(truth: Truth, kept: np.ndarray) -> dict[str, float]:
    """Return mesh, convergence and cost of a truth, over the samples ``kept`` (k,) bool or, of extremes, over all."""
    row = {"radius_m": truth.radius_m, "level": truth.level, "elements": truth.elements, "nodes": truth.nodes}
    row |= {"inverted": int((truth.least_det <= 0.0).sum()), "squeezed": int((truth.least_det < SQUEEZED).sum())}
    row |= {"order": over(lambda r: np.log2(np.mean(r)), truth.ratio[kept])}
    row |= {"ratio_min": over(np.min, truth.ratio), "ratio_max": over(np.max, truth.ratio)}
    row |= {"least_det": over(np.min, truth.least_det), "seconds": over(np.median, truth.seconds[kept])}
    counts = {"volume_change": truth.volume_change, "iterations": truth.iterations, "cycles": truth.products}
    return row | {name: over(np.mean, values[kept]) for name, values in counts.items()}


def _own(truth: Truth, samples: np.ndarray, kinds: Iterable[str], before: str = "") -> dict[str, float]:
    """Return the means and maxima of the truth's own errors of ``samples`` (k,) bool.

    before : a prefix of the columns' names
    """
    errors = {before + kind: truth.own[samples, OWN.index(kind)] for kind in kinds}
    means = {name: over(np.mean, each) for name, each in errors.items()}
    return means | {f"{name}_max": over(np.max, each) for name, each in errors.items()}


def _means(rows: pd.DataFrame, name: str, patch: str) -> dict:
    """Return the mean errors over ``rows`` as the columns ``name`` and ``patch``, and the number of rows."""
    means = rows[["rmse_of_peak", "patch_rms_of_peak"]].mean()
    samples = f"{name.removesuffix('_of_peak')}_samples"
    return {name: means["rmse_of_peak"], patch: means["patch_rms_of_peak"], samples: len(rows)}


def truth_table(
    truths: Mapping[str, Truth],
    others: Mapping[str, pd.DataFrame] | None = None,
    shares: Mapping[str, pd.DataFrame] | None = None,
) -> pd.DataFrame:
    """Tabulate truth.csv, a row a scene.

    others : the checks by another element of the scenes that have them; shares : what facets change, likewise
    """
    rows = [
        truth_row(scene, truth, (others or {}).get(scene), (shares or {}).get(scene)) for scene, truth in truths.items()
    ]
    return TRUTH.frame(rows)


OTHER_ELEMENT_COLUMNS = ["sample", *TruthErrors._fields, "ratio", "finest_rmse_of_peak"]


def other_element(
    body: Body, presses: Sequence[Sample], truth: Truth, samples: Sequence[int] | np.ndarray, progress: Callable = iter
) -> pd.DataFrame:
    """Tabulate how far the limit of linear elements is from ``truth``, a row for each of ``samples`` that is believed.

    The levels are the last three that have the truth's nodes: linear elements on a level have those of quadratic ones
    on the level before. ratio : by how much their last halving reduced the change, as it is; finest_rmse_of_peak : the
    error of the finest linear answer itself. ``progress`` wraps the sequence of all solutions, as ``tqdm`` does. A
    sample that linear elements do not answer has no row.
    """
    finest = truth_levels(body)[-1] + 1
    levels = range(finest - 2, finest + 1)
    refined_body = finer(body, finest + 1 - len(body.levels))
    rows = truth.rows(np.asarray(samples))
    samples_asked = _numbered(presses, truth.sample[rows])
    limits: list[list[np.ndarray]] = [[] for _ in samples_asked]
    starts: list[np.ndarray | None] = [None] * len(samples_asked)
    solver: Equilibrium | None = None
    unsolved: set[int] = set()
    for level, i in progress([(level, i) for level in levels for i in range(len(samples_asked))]):
        if i == 0 or solver is None:
            solver = None  # before the next one is made, which is eight times as large
            solver = Equilibrium(refined_body, level)
        if i in unsolved:
            continue
        try:
            rest_nodes, start = solver.mesh.nodes, starts[i]
            forces = samples_asked[i].nodal(body, level, whole=refined_body)
            displacement = solver.solve(forces, NEXT, None if start is None else rest_nodes + start).x - rest_nodes
        except NotConverged:
            unsolved.add(i)
            continue
        starts[i] = refined_body.prolongations[level] @ displacement if level < finest else None
        limits[i].append(_on_surface(body, refined_body, level, displacement))
    return pd.DataFrame(
        [
            _row(body, sample, np.array(answers), truth.displacement[row])
            for i, (sample, answers, row) in enumerate(zip(samples_asked, limits, rows, strict=True))
            if i not in unsolved
        ],
        columns=OTHER_ELEMENT_COLUMNS,
    )


def _numbered(presses: Sequence[Sample], numbers: np.ndarray) -> list[Sample]:
    known = {press.number: press for press in presses}
    return [known[number] for number in numbers]


def widened(truth: Truth, check: pd.DataFrame) -> Truth:
    """Return ``truth`` with own errors large enough to cover the distances in ``check``, rows of ``other_element``.

    For each kind of error the mean distance over the mean own error of the same samples, if above 1, is a factor by
    which the own errors of all samples grow. None becomes smaller.
    """
    if check.empty:
        return truth
    rows = [int(np.flatnonzero(truth.sample == sample)[0]) for sample in check["sample"]]
    distances, own_errors = check[list(OWN)].to_numpy(), truth.own[rows]
    factors = np.fmax(1.0, distances.mean(axis=0) / own_errors.mean(axis=0))
    grown = truth.own * factors
    grown[rows] = np.fmax(grown[rows], distances)
    return replace(truth, own=grown)


def _on_surface(body: Body, whole: Body, level: int, moved: np.ndarray) -> np.ndarray:
    for prolongation in whole.prolongations[level : len(body.levels) - 1]:
        moved = prolongation @ moved
    return moved[body.fine.surface]


def _row(body: Body, sample: Sample, levels: np.ndarray, truth: np.ndarray) -> dict:
    patch = sample.pressed(body)
    row = {"sample": sample.number} | truth_errors(limit(levels), truth, patch)._asdict()
    return row | {"ratio": ratio(levels), "finest_rmse_of_peak": truth_errors(levels[-1], truth, patch).rmse_of_peak}


GEOMETRY_COLUMNS = ["sample", *TruthErrors._fields, "seconds"]
LEVEL = 1
"""Level of the quadratic elements, for an eighth of the time that the next one takes."""
ORDER = 2
"""Order by which facets whose corners are on a smooth surface come nearer to it with every level."""


def geometry_share(
    body: Body,
    surface: SmoothSurface,
    presses: Sequence[Sample],
    truth: Truth,
    samples: Sequence[int] | np.ndarray,
    progress: Callable = iter,
) -> pd.DataFrame:
    """Tabulate how far the answers of a body of flat facets and of one on its smooth ``surface`` are apart.

    A row for each of ``samples`` that is believed; ``seconds`` is the time of its solution. ``body`` is one of the two,
    whose answer is that of ``truth`` on level 1, the other is made of its coarse mesh. Contacts are the same nodes of
    it, and what is held, the material, the disc that is pressed and the total force are the same, too. Both are
    answered by quadratic elements with equally many unknowns, so that what these leave out nearly cancels. What the
    facets of that level itself leave out, a quarter of the whole on level 1, is added by the order of 2. Errors are
    those of ``truth_errors``. ``progress`` wraps the sequence of all solutions, as ``tqdm`` does.
    """
    level = max(LEVEL, len(body.levels) - 2)
    rows = truth.rows(np.asarray(samples))
    asked = _numbered(presses, truth.sample[rows])
    other_body = finer(replace(body.up_to(0), smooth=surface if body.smooth is None else None), len(body.levels) - 1)
    answers, _ = ascend(other_body, asked, [range(level, level + 1)] * len(asked), FIRST, progress)
    shares = []
    for row, answer in zip(rows, answers, strict=True):
        if answer.failure:
            continue
        body_answer, truth_limit = truth.levels[row, level - truth_levels(body)[0]], truth.displacement[row]
        change = (answer.surface[0] - body_answer) / (1.0 - 2.0 ** (-ORDER * level))
        patch = answer.sample.pressed(body)
        shares.append([truth.sample[row], *truth_errors(truth_limit + change, truth_limit, patch), answer.seconds])
    return pd.DataFrame(shares, columns=GEOMETRY_COLUMNS)


LIMIT_POINTS = Table(
    "limit_points",
    "The dent under a growing pressure, contact by contact: where the law itself has more than one answer.",
    """
    body contact: the node that is pressed
    pressure_of_young: peak pressure / Young's modulus
    peak_of_size: largest displacement / the body's size
    least_det converged: least determinant of F, and whether there is an answer
    """,
    always=False,
)
PRESSURES = tuple(np.round(np.arange(0.02, 0.4001, 0.02), 2))
"""Peak pressures 2 F / (π radius²) as shares of Young's modulus, which tissue models are not meant to exceed."""
TOLERANCE = 1e-6
PRESSED_LEVEL = 1
"""Level of the quadratic elements: fine enough to show the law's limits, coarse enough for a minute."""


def limit_points(
    body: Body,
    radius_m: float,
    contacts: Sequence[int] | int = 4,
    pressures: Sequence[float] = PRESSURES,
    progress: Callable = iter,
) -> pd.DataFrame:
    """Tabulate LIMIT_POINTS: press inward on a disc of ``radius_m`` [m], harder in each step, starting from the last.

    contacts : coarse nodes, or how many of those that ``kept_contacts`` spreads; InputError for one that is not free,
        or for a radius that ``check_radius`` refuses
    Returns one row a step: the peak displacement reached, the smallest det F (0 and below: an element is
    inverted), and whether an equilibrium was found; if not, the first two are empty, and the contact ends there.
    """
    check_radius(body, radius_m)
    pressable = contacts_of(body)
    chosen = kept_contacts(body, contacts) if isinstance(contacts, int) else np.asarray(contacts)
    for contact in chosen:
        row_of(pressable, int(contact), f"tradeoff.limit_points.contacts of {body.name}: ")
    level = min(PRESSED_LEVEL, len(body.levels) - 1)
    whole = body if level + 1 < len(body.levels) else finer(body)
    problem = Equilibrium(whole, level, order=2)
    rows: list[list] = []
    for contact in progress([int(node) for node in chosen]):
        force_at_young = -body.fine.normals[contact] * body.material.young_pa * np.pi * radius_m**2 / 2.0
        unit_load = nodal_load(whole, level, contact, force_at_young, radius_m, order=2)
        rows += [[body.name, contact, *step] for step in _curve(problem, unit_load, pressures, body.fine.size)]
    return LIMIT_POINTS.frame(rows)


def _curve(problem: Equilibrium, unit_load: np.ndarray, pressures: Sequence[float], size: float) -> list[list]:
    """Return pressure, peak over ``size`` [m], smallest det F and success of each step."""
    steps: list[list] = []
    positions = None
    for pressure in pressures:
        try:
            positions = problem.solve(pressure * unit_load, TOLERANCE, start=positions).x
        except NotConverged:
            return [*steps, [pressure, np.nan, np.nan, False]]
        peak = float(np.linalg.norm(positions - problem.mesh.nodes, axis=1).max())
        steps.append([pressure, peak / size, problem.least_det(positions), True])
    return steps
