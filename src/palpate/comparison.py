"""Compare ways of answering presses on one body: ``make_case``, ``compare``, ``advise`` and ``plot_precision``."""

import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate import pictures
from palpate.benchmark.accuracy import Judge, TruthErrors, patch_nodes
from palpate.benchmark.advice import advise as advice_of
from palpate.benchmark.conformal import FEWEST
from palpate.benchmark.database import split
from palpate.benchmark.measuring import said
from palpate.benchmark.model import Case, Model
from palpate.benchmark.press_measure import bounds, failed, measure
from palpate.benchmark.presses import PRESSURE, UNCAPPED, choose_presses
from palpate.benchmark.ranking import BOUNDS
from palpate.benchmark.settings import FitOptions
from palpate.benchmark.static_responses import assemble, press
from palpate.bodies.body import Body, Makes, as_body
from palpate.errors import InputError, explained
from palpate.models.own_model import as_model
from palpate.setting_types import Block, Index, Inside, NotNegative, Number, Positive, Whole, check
from palpate.solvers.compliance import compute_compliance

TEST = 0.4
"""Share of the contacts that models are asked at; the others may be learnt from."""
LEAST_CONTACTS = 24
"""Fewest contacts of a case: without any one of those that are asked, FEWEST are left, of which there is a bound."""
DEEPEST = 0.5
"""Largest peak of a press, as a share of the body's longest side."""
STRAIGHT = {"magnitude": 1.0, "tilt_degrees": 0.0}
"""A press along the inward normal."""
TOLERANCE = 1e-6
"""Relative residual of the reference and of what is learnt from."""


@dataclass(frozen=True, eq=False)
class ComparedCase:
    """A body under presses: ``case`` is what models may see, ``judge`` has what they are asked and the right answers.

    These are quadratic elements' on the body's finest level, whose own error the study ``tradeoff`` finds, not this.
    """

    case: Case
    judge: Judge

    def __repr__(self) -> str:
        counts = f"{self.case.n_training} presses to learn from, {len(self.judge.samples.contact)} to answer"
        return f"<ComparedCase of {self.case.body.name}: {counts}>"


def make_case(
    body: Body | Makes,
    *,
    radius_m: float,
    contacts: int = 25,
    peak_of_size: float = 0.05,
    seed: int = 1,
    progress: Callable = iter,
) -> ComparedCase:
    """Press a body; return the presses that models may learn from, and those that they are judged by.

    body : or its settings; radius_m : of the disc that is pressed [m]
    peak_of_size : largest displacement, as a share of the body's longest side
    contacts : how many, of which two fifths are held out; progress : wraps sequences, as ``tqdm`` does
    Warns of presses that are lowered, as the body would collapse.
    Raises InputError for too few contacts or a body without a finer level, NotConverged for a press that has no answer.
    """
    body = as_body(body)
    check(radius_m=(Positive, radius_m), contacts=(Whole, contacts), peak_of_size=(Number, peak_of_size))
    check(seed=(Index, seed), progress=(Callable, progress))
    contacts, seed = int(contacts), int(seed)
    if contacts < LEAST_CONTACTS:
        reason = f"as a bound of errors needs {FEWEST} of the {100 * TEST:g} % that are held out, and one to try it on"
        raise InputError(f"contacts is {contacts}; give at least {LEAST_CONTACTS}, {reason}.")
    if not 0.0 < peak_of_size <= DEEPEST:
        raise InputError(f"peak_of_size is {peak_of_size:g}; give a share above 0, of at most {DEEPEST:g}.")
    if len(body.levels) < 2:
        raise InputError(f"{body.name} has one mesh; give it refinements of at least 1.")
    regime = {"peak_of_size": peak_of_size}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"bodies\..* presses are lowered", UserWarning)  # in words of a configuration
        loads = choose_presses(body, contacts, [STRAIGHT], regime, radius_m, seed, progress)
    if lowered := (loads["capped"] != UNCAPPED).sum():
        warnings.warn(
            f"{lowered} of {contacts} presses of {body.name} are less deep than peak_of_size {peak_of_size:g}, as they "
            f"would exceed a pressure of {PRESSURE:g} of Young's modulus, or turn an element inside out, or the body "
            "would collapse; give make_case a smaller peak_of_size, or a larger radius_m, to have all as asked.",
            stacklevel=2,
        )
    compliance = compute_compliance(body, radius_m, progress, np.sort(loads["contact"].to_numpy()), order=2)
    fine = press(body, len(body.levels) - 1, loads, TOLERANCE, progress, order=2)
    samples = assemble(body, loads, fine, press(body, 0, loads, TOLERANCE), "")
    tests = round(TEST * contacts)
    learnt, held_out = split(samples.contact, contacts - tests, tests, "contacts", seed)
    case = Case(body, "press", radius_m, samples.take(learnt), compliance, FitOptions(seed=seed), TOLERANCE)
    judged = samples.take(held_out)
    patch = np.array([patch_nodes(body.fine, int(contact), radius_m) for contact in judged.contact])
    not_estimated = np.full((tests, len(TruthErrors._fields)), np.nan)  # the truth's own errors
    sides = np.full(tests, "test")
    return ComparedCase(case, Judge(1, held_out, sides, judged, judged.fine, not_estimated, judged.seconds, patch))


@dataclass(frozen=True, eq=False)
class Comparison:
    """What models answered: a row a model in ``table``, a row an answer in ``answers``, as in docs/tables.md."""

    table: pd.DataFrame
    answers: pd.DataFrame

    def __repr__(self) -> str:
        return f"<Comparison: {len(self.summary)} rows of models, {len(self.answers)} answers>"

    @property
    def summary(self) -> pd.DataFrame:
        """Model, setting, mean error over the surface and in the dent, time of an answer and of the preparation."""
        rows = self.table[~self.table["model"].isin(BOUNDS)]
        about = rows[["model", "setting", "failures"]].copy()
        about["error [%]"] = 100 * rows["rmse_of_peak"]
        about["error in the dent [%]"] = 100 * rows["patch_rms_of_peak"]
        about["answer [ms]"] = 1e3 * rows["online_median_s"]
        about["preparation [s]"] = rows["offline_s"]
        return about.reset_index(drop=True)

    def __str__(self) -> str:
        return self.summary.to_string(index=False, float_format="{:.3g}".format)

    def _repr_html_(self) -> str:
        return self.summary.to_html(index=False, float_format="{:.3g}".format)


def compare(compared_case: ComparedCase, models: Iterable[Any], repeats: int = 20, budget_s: float = 0.2) -> Comparison:
    """Prepare each model, ask it the presses that are held out, time and judge its answers.

    models : FEM(), ContactModes() ... and objects of your own with ``prepare(case)`` (docs/add-a-model.md)
    repeats : calls that are timed, fewer if they take longer than ``budget_s`` [s]
    Raises InputError for a model that is none; a model that fails has empty cells, and ``failure`` says why.
    """
    if not isinstance(compared_case, ComparedCase):
        raise InputError(f"compare needs what make_case returns, and not a {type(compared_case).__name__}.")
    if isinstance(models, Block) or not isinstance(models, Iterable):
        raise InputError(f"compare needs a list of models, such as [FEM(order=1)], and not {models!r}.")
    check(repeats=(Whole, repeats), budget_s=(NotNegative, budget_s))
    families: dict[str, list[Model]] = {}
    for each in models:
        if isinstance(each, type) or not callable(getattr(each, "prepare", None)):
            raise InputError(f"{each!r} is no model; give FEM() or another one, or an object with prepare(case).")
        model = each if isinstance(each, Model) else as_model(each, type(each).__name__)
        if model.name in BOUNDS:
            raise InputError(f"{model.name} is a row of every comparison; call your class something else.")
        if model.text in [other.text for other in families.setdefault(model.name, [])]:
            raise InputError(f"{model.name} is given with {model.text} twice; give each setting once.")
        families[model.name].append(model)
    if not families or repeats < 1:
        raise InputError(f"there are {len(families)} models and {repeats} repeats; give at least one of each.")
    measured = []
    for model in (each for family in families.values() for each in family):
        try:
            measured.append(measure(compared_case.case, model.name, [model], compared_case.judge, repeats, budget_s))
        except Exception as error:  # one model's fault is no other's
            kind = type(error).__name__
            reason = said(error) if isinstance(error, InputError) else f"{type(model).__name__}: {kind}: {said(error)}"
            measured.append(failed(compared_case.case, model, compared_case.judge, reason))
    answers, table = zip(*measured, bounds(compared_case.case, compared_case.judge), strict=True)
    rows = pd.concat(table, ignore_index=True)
    rows = rows[rows["model"] != "truth"].assign(break_even_queries=np.nan)
    rows[["rejected", "rejected_answered"]] = 0  # all are without a truth
    return Comparison(rows, pd.concat(answers, ignore_index=True))


def advise(compared: Comparison, budget_ms: float | None = None, max_error: float | None = None) -> str:
    """Say which of the compared models to take: within a time of an answer [ms], or below an error of the peak."""
    _check(compared)
    if (budget_ms is None) == (max_error is None):
        raise InputError("give either budget_ms or max_error.")
    check(budget_ms=(Positive | None, budget_ms), max_error=(Inside | None, max_error))
    limits = {"budgets_ms": [budget_ms]} if max_error is None else {"max_errors": [max_error]}
    row = advice_of(compared.table, compared.answers, kinds=["rms"], **limits).iloc[0]
    with explained():
        from palpate.report.advice_words import lines

    return lines(row)


def plot_precision(compared: Comparison, path: str | Path) -> None:
    """Draw error against time of an answer for all models, as the study ``tradeoff`` does, as a .png, .svg or .pdf."""
    _check(compared)
    pictures.check_path(path, ".png", ".svg", ".pdf")
    asked = compared.table[~compared.table["model"].isin(BOUNDS)]
    if asked["rmse_of_peak"].isna().all():
        raise InputError(f"no model has answered, so that there is nothing to draw: {asked['failure'].iloc[0]}")
    with explained():
        from palpate.studies.tradeoff.figures.precision import draw_work_precision

    nothing = pd.DataFrame({"scene": [], "error": [], "budget_ms": [], "model": []})
    draw_work_precision(compared.table, nothing, scene=compared.table["scene"].iloc[0]).savefig(path)


def _check(compared: Any) -> None:
    if not isinstance(compared, Comparison):
        raise InputError(f"this needs what compare returns, and not a {type(compared).__name__}.")
