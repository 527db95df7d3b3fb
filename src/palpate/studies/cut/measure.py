"""Measure errors of models of a body whose cut is pulled apart, and their times from the blade's move on."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.cut_truth import CutTruth, Hook, Pulled, mouth, pull_errors, truth_of_cut
from palpate.benchmark.measuring import CALLS, Call, Kind, Prepared, Row, measure, online, prepared, said, time_calls
from palpate.benchmark.model import Setting, held_mb, setting_text
from palpate.benchmark.ranking import TRUTH
from palpate.bodies.body import Body
from palpate.bodies.cutting.cut import Blade, Cut, make_cut
from palpate.bodies.cutting.ways import VIRTUAL_NODES
from palpate.errors import InputError, NotConverged
from palpate.models.cut.opened import CutCase, CutModel
from palpate.models.cut.tried import MODELS, TRIED
from palpate.solvers.grasping import patch_around
from palpate.stores import store
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
    """Make the cut and the hooks of an entry of ``cut.cuts`` on a body; InputError where it describes no cut."""
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


class Pulls(Kind):
    """A cut whose lips are pulled apart; the three questions are the calls that TIMES names.

    These are the change of a model to the cut body, its first answer, and a further answer. An answer that ``begin``
    asks for beforehand is judged. Where the truth was rejected there are no errors.
    openings : rows of CUT_OPENING, the truth's first
    """

    def __init__(self, scene: str, case: CutCase, truth: CutTruth, repeats: int, budget_s: float):
        super().__init__({"scene": scene, "body": case.body.name}, [{}] * len(TIMES))
        self.case, self._truth, self._limits = case, truth, (repeats, budget_s)
        self.openings: list[Row] = []
        self._add_opening({"model": TRUTH, "setting": "", "level": "", "way": ""}, truth.pulled)

    def begin(self, solver: CutModel) -> None:
        self._held_mb = held_mb(solver)
        with _input_error_as_failure():
            self._answer = _cut_and_pull(solver, self.case.cuts)

    def call(self, solver: CutModel, i: int) -> Call:
        return solver.pull if i else partial(solver.cut, self.case.cuts)

    def further(self, one: Prepared, rows: list[Row]) -> tuple[Row, list[Row]]:
        """Return errors and times; a model is asked to follow a blade in steps if its first answer is soon enough."""
        columns: Row = {f"own_{name}": value for name, value in zip(ERRORS, self._truth.own, strict=True)}
        if any(row["failure"] for row in rows):
            return columns, []
        self._add_opening(one.about, self._answer)
        if not self._truth.rejected:
            columns |= dict(zip(ERRORS, pull_errors(self._answer, self._truth.pulled), strict=True))
        change_s, first_s, again_s = (np.array(row[CALLS]) for row in rows)
        first_s += change_s[: len(first_s)]
        steps = self._steps(one.solver) if np.median(first_s) <= SOON_S else []
        for name, calls in zip((*TIMES, "step"), (change_s, first_s, again_s, steps), strict=True):
            columns |= online([[seconds] for seconds in calls], name)
        lost_share = getattr(one.solver, "lost_share", 0.0)
        return columns | {"lost_share": lost_share, "calls": len(first_s), "memory_mb": self._held_mb}, []

    def _steps(self, solver: CutModel) -> Sequence[float]:
        """Return the times [s] of answers after each step of a moving blade; none of other cuts, or where one fails."""
        (cut,), (repeats, budget_s) = self.case.cuts, self._limits
        if not isinstance(cut, Blade):
            return []
        stops = [cut.up_to(share * cut.length_m) for share in np.arange(1, BLADE_STEPS) / BLADE_STEPS]
        calls = [partial(_cut_and_pull, solver, [stop]) for stop in (*stops, cut)]
        timed_calls = time_calls(calls, BLADE_STEPS * repeats, budget_s)
        return [] if any(timed_calls.failures) else [seconds for each in timed_calls.seconds for seconds in each]

    def _add_opening(self, about: Row, answer: Pulled) -> None:
        along = np.linalg.norm(self.case.places - self.case.places[:1], axis=1)
        for at, wide in zip(along, np.linalg.norm(answer.opening, axis=1), strict=True):
            self.openings.append(self.labels | about | {"along_m": at, "opening_m": wide})


def _cut_and_pull(model: CutModel, cuts: Sequence[Cut]) -> Pulled:
    model.cut(cuts)
    return model.pull()


@contextmanager
def _input_error_as_failure() -> Iterator[None]:
    """Raise NotConverged in place of an InputError, as where a cut leaves nothing of a level."""
    try:
        yield
    except InputError as failure:
        raise NotConverged(said(failure), []) from failure


def measure_models(
    scene: str,
    case: CutCase,
    truth: CutTruth,
    repeats: int,
    budget_s: float,
    progress: Callable = iter,
    tried: Mapping[str, list[Setting]] = TRIED,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Measure all settings of all models on one cut; return CUT and CUT_OPENING.

    repeats, budget_s : as of ``time_calls``; progress : wraps the settings, as ``tqdm`` does
    tried : settings by model; those on levels that the body does not have are left out
    """

    def settings() -> Iterator[Prepared]:
        possible = [(model, each) for model in tried for each in tried[model] if each["level"] < len(case.body.levels)]
        for model, setting in progress(possible):
            how_cut = setting.get("way", WHOLE if model == "enriched_responses" else VIRTUAL_NODES)
            about = {"model": model, "setting": setting_text(setting), "level": setting["level"], "way": how_cut}
            yield prepared(about, _input_error_as_failure()(partial(MODELS[model], case=case, **setting)))

    kind = Pulls(scene, case, truth, repeats, budget_s)
    _, rows = measure(kind, settings(), len(TIMES) * repeats, budget_s)
    return CUT.frame(rows), CUT_OPENING.frame(kind.openings)


def _length(vectors: np.ndarray) -> float:
    return float(np.linalg.norm(vectors, axis=1).max(initial=0.0))


FRONT_OF_WIDTH = 0.5
"""Longest edges at the front of a cut over its half width, on the meshes that are halved; elsewhere at the cut 1."""


def find_cut_truth(body: Body, output: Any, wildcards: Any, entry: Pull) -> dict[str, pd.DataFrame]:
    """Find the truth of a cut, for the rule of that name (workflow/job.py says how it is called)."""
    case = asked(body, entry)
    cut = case.cuts[0]
    truth = truth_of_cut(case.body, cut, case.hooks, cut.narrow_m, FRONT_OF_WIDTH * cut.narrow_m, case.places)
    store(truth, output.truth)
    return {"table": truth_row(wildcards.scene, case, truth)}


def measure_cut(
    body: Body, truth: CutTruth, wildcards: Any, entry: Pull, repeats: int, budget_s: float, progress: Callable
) -> dict[str, pd.DataFrame]:
    """Measure all models of a cut, for the rule of that name."""
    tables = measure_models(wildcards.scene, asked(body, entry), truth, repeats, budget_s, progress)
    return dict(zip(("cut", "opening"), tables, strict=True))
