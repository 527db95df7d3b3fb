"""Measure what models make of a cut whose lips are pulled apart, and how long they take from the blade's move on."""

from collections.abc import Callable, Mapping
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.cut_truth import CutTruth, Hook, Pulled, mouth, pull_errors
from palpate.benchmark.model import Setting, held_mb, setting_text
from palpate.benchmark.ranking import TRUTH
from palpate.benchmark.timing import said, time_calls
from palpate.bodies.body import Body
from palpate.bodies.cutting.cut import Blade, Cut, make_cut
from palpate.bodies.cutting.ways import VIRTUAL_NODES
from palpate.errors import InputError, NotConverged
from palpate.models.cut.opened import CutCase, CutModel
from palpate.models.cut.tried import MODELS, TRIED
from palpate.solvers.grasping import patch_around
from palpate.studies.cut.settings import Pull
from palpate.table_declaration import Table

CUT_TRUTH = Table(
    "cut_truth",
    "How exactly the truth of each cut is known, and what it takes.",
    """
    scene body: a cut by its name, and the body
    surface_error opening_error force_error: own errors: RMS over the surface over the peak, the largest of the opening
        over the largest opening, the largest of the hooks' forces over the largest force
    peak_m opening_m force_n: largest displacement of the surface [m], opening [m] and force of a hook [N]
    front_ratio rim_ratio: by how much the second halving at the front of the cut, and at the rims of what is held or
        grasped, has changed the surface less than the first
    least_opening_m: least opening of the lips, along the normal of the cut [m]; negative: they overlap
    least_det least_angle: least determinant of F, and least angle of an element of the mesh that is halved [°]
    nodes seconds: of the largest mesh; of the whole [s]
    rejected: why it judges no model
    """,
)
CUT = Table(
    "cut",
    "The errors and times of every model at each of its settings after a cut.",
    """
    scene body: a cut by its name, and the body
    model setting level way: what answers, on which level, and how that is cut
    surface_error opening_error force_error: RMS over the surface over the peak, the largest of the opening over the
        largest opening, the largest of the hooks' forces over the largest force
    own_surface_error own_opening_error own_force_error: the truth's own
    lost_share: of the volume, with removed elements
    change_median_s change_p95_s change_max_s: from the blade's move until a model is ready to answer [s]
    first_median_s first_p95_s first_max_s: from the blade's move until the first answer [s]
    again_median_s again_p95_s again_max_s: time of a further answer [s]
    step_median_s step_p95_s step_max_s: of a blade that moves in ten steps, from each step until the answer to it [s];
        none where a first answer takes longer than 0.1 s
    calls offline_s memory_mb: how often it was cut and timed, preparation before the cut [s], and what it holds then
        [1e6 bytes]
    failure: why there is no answer
    """,
)
CUT_OPENING = Table(
    "cut_opening",
    "How far the lips open along each cut, for the truth and for every setting.",
    """
    scene model setting level way: a cut by its name, and what answers
    along_m opening_m: a place of the mouth, from the first one on, and how far the lips are apart there [m]
    """,
)
ERRORS = ("surface_error", "opening_error", "force_error")
TIMES = ("change", "first", "again")
BLADE_STEPS, SOON_S = 10, 0.1
"""Steps of a blade along its path, and the time of a first answer [s] up to which a model is asked to follow them."""
WHOLE = "enriched"
"""How a level is cut that stays whole, and whose displacement jumps."""


def asked(body: Body, entry: Pull) -> CutCase:
    """Return the question that a block of ``cut.cuts`` asks of a body; InputError where it describes no cut."""
    cut, coarse, fine = make_cut("cut", entry.cut, body.fine), body.coarse, body.fine
    hooks = []
    for hook in entry.hooks:
        # coarse nodes are nodes of all levels, so that each level has what is grasped
        node = coarse.surface[np.linalg.norm(coarse.nodes[coarse.surface] - hook.at_m, axis=1).argmin()]
        hooks.append(Hook(patch_around(fine, int(node), hook.radius_m), np.array(hook.shift_m, dtype=float)))
    return CutCase(body, [cut], hooks, mouth(fine, cut))


def truth_row(scene: str, case: CutCase, truth: CutTruth) -> pd.DataFrame:
    """Tabulate CUT_TRUTH of one cut."""
    row = {"scene": scene, "body": case.body.name} | dict(zip(ERRORS, truth.own, strict=True))
    pulled = truth.pulled
    row |= {"peak_m": _length(pulled.displacement), "opening_m": _length(pulled.opening)}
    row |= {"force_n": float(np.abs(pulled.force).max())}
    kept = ("front_ratio", "rim_ratio", "least_opening_m", "least_det", "least_angle", "nodes", "seconds", "rejected")
    return CUT_TRUTH.frame([row | {name: getattr(truth, name) for name in kept}])


def measure_cut(
    scene: str,
    case: CutCase,
    truth: CutTruth,
    repeats: int,
    budget_s: float,
    progress: Callable = iter,
    tried: Mapping[str, list[Setting]] = TRIED,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Measure all settings of all models: rows of CUT and of CUT_OPENING.

    repeats, budget_s : as of ``time_calls``; progress : wraps the settings; tried : these by model
    Levels that the body has not are left out, and errors where the truth judges no model; on one BLAS thread.
    """
    from threadpoolctl import threadpool_limits

    rows, along = [], np.linalg.norm(case.places - case.places[:1], axis=1)
    labels = {"scene": scene, "model": TRUTH, "setting": "", "level": "", "way": ""}
    openings = _openings(labels, along, truth.pulled)
    own = {f"own_{name}": value for name, value in zip(ERRORS, truth.own, strict=True)}
    with threadpool_limits(limits=1):
        own_levels = [
            (model, each) for model in tried for each in tried[model] if each["level"] < len(case.body.levels)
        ]
        for model, setting in progress(own_levels):
            way = setting.get("way", WHOLE if model == "enriched_responses" else VIRTUAL_NODES)
            labels = {"scene": scene, "model": model, "setting": setting_text(setting)}
            labels |= {"level": setting["level"], "way": way}
            answer, row = _measured(model, case, setting, repeats, budget_s)
            if answer is not None:
                openings += _openings(labels, along, answer)
                if not truth.rejected:
                    row |= dict(zip(ERRORS, pull_errors(answer, truth.pulled), strict=True))
            rows.append({"body": case.body.name} | labels | own | row)
    return CUT.frame(rows), CUT_OPENING.frame(openings)


def _measured(
    name: str, case: CutCase, setting: Setting, repeats: int, budget_s: float
) -> tuple[Pulled | None, dict[str, Any]]:
    """Return the answer of a setting, or None, and the row of its times: it is cut, asked twice, and cut again."""
    begin = perf_counter()
    try:
        model = MODELS[name](case=case, **setting)
        offline, memory = perf_counter() - begin, held_mb(model)
        model.cut(case.cuts)
        answer = model.pull()
    except (NotConverged, InputError) as failure:
        return None, {"failure": said(failure)}
    timed = time_calls([partial(model.cut, case.cuts), model.pull, model.pull], 3 * repeats, budget_s)
    if failed := next(filter(None, timed.failures), ""):
        return None, {"failure": failed}
    change, first, again = map(np.array, timed.seconds)
    first += change[: len(first)]
    row: dict[str, Any] = {"lost_share": getattr(model, "lost_share", 0.0), "calls": len(first)}
    row |= {"offline_s": offline, "memory_mb": memory}
    times = dict(zip(TIMES, (change, first, again), strict=True))
    if np.median(first) <= SOON_S and len(steps := _steps(model, case, repeats, budget_s)):
        times["step"] = steps
    for time, values in times.items():
        row |= {f"{time}_median_s": np.median(values), f"{time}_p95_s": np.percentile(values, 95)}
        row |= {f"{time}_max_s": values.max()}
    return answer, row | {"failure": ""}


def _steps(model: CutModel, case: CutCase, repeats: int, budget_s: float) -> np.ndarray:
    """Return the times (n,) [s] of answers to a blade that moves; none of another cut, or where one fails."""
    (cut,) = case.cuts
    if not isinstance(cut, Blade):
        return np.empty(0)
    stops = [cut.up_to(share * cut.length_m) for share in np.arange(1, BLADE_STEPS) / BLADE_STEPS]
    timed = time_calls([partial(_follow, model, stop) for stop in (*stops, cut)], BLADE_STEPS * repeats, budget_s)
    return np.empty(0) if any(timed.failures) else np.concatenate(timed.seconds)


def _follow(model: CutModel, cut: Cut) -> Pulled:
    model.cut([cut])
    return model.pull()


def _openings(labels: dict[str, Any], along: np.ndarray, answer: Pulled) -> list[dict[str, Any]]:
    """Return the rows of CUT_OPENING of an answer at places ``along`` (k,) [m] the mouth."""
    wide = np.linalg.norm(answer.opening, axis=1)
    return [labels | {"along_m": a, "opening_m": w} for a, w in zip(along, wide, strict=True)]


def _length(vectors: np.ndarray) -> float:
    return float(np.linalg.norm(vectors, axis=1).max(initial=0.0))
