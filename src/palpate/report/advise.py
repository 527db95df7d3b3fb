"""Carry out ``palpate advise``: read the tables of a run, say in words what to take, and try that advice.

It is tried on the same machine another day, and at contacts that had no part in it.
"""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark import advice as pressed
from palpate.benchmark import advice_other_loads as other_loads
from palpate.benchmark.advice import ADVICE, NONE, Question
from palpate.benchmark.held_out import SETTING
from palpate.benchmark.ranking import EQUAL, KINDS, read_errors
from palpate.benchmark.split import deal
from palpate.benchmark.touch_advice import advise_touch
from palpate.errors import InputError
from palpate.report import tables
from palpate.report.advice_words import advice_list, any_load_lines, force_lines, lines


def advise(results: Path, scene: str | None, limits: dict[str, list[float]], error: str) -> str:
    """Advise for one scene or for all; without limits, what the run was asked for.

    limits : by what is limited: budgets_ms, max_errors or speeds; error : of which kind
    InputError for tables that ``results`` lacks, and a scene that they lack.
    """
    names = ("accuracy_vs_time", "dynamic_accuracy") if limits else ("advice",)
    paths = [results / "tables" / f"{name}.csv" for name in names]
    found = [tables.read(path) for path in [path for path in paths if path.is_file()] or paths[:1]]
    known = [name for table in found for name in tables.scenes(table)]
    if scene is not None and scene not in known:
        raise InputError(f"--scene {scene} is not in {results}; choose from {', '.join(known)}.")
    chosen = known if scene is None else [scene]
    if not limits:
        return _listed(found[0], chosen, error, results)
    said, refused = [], 0
    for name in chosen:
        try:
            said.append(_of_scene(results, name, found, limits, error))
        except _NoSuchLimit as refusal:
            refused += 1
            if refused == len(chosen):  # nothing is left that has such a limit
                raise
            said.append(str(refusal))
    return "\n".join(said)


class _NoSuchLimit(InputError):
    """A scene was asked for what it does not have: a patch, or a speed."""


def _listed(table: pd.DataFrame, chosen: list[str], error: str, results: Path) -> str:
    """List the rows of advice.csv about the scenes ``chosen``, and name the scenes without a row of that ``error``."""
    rows = table[table["scene"].isin(chosen)]
    there = set(rows.loc[rows["error"] == error, "scene"])
    lost = [_no_patch(name, error) for name in chosen if name not in there]
    if not there:
        raise InputError(lost[0] if len(lost) == 1 else f"{results} has no advice by --error {error}; leave it out.")
    return "\n".join([advice_list(rows, error), *lost])


def _no_patch(scene: str, error: str) -> str:
    return (
        f"{scene}: models of a scene that moves are judged over its surface and by force, and not where it is pressed, "
        f"of which motion_truth.csv has the truth's own error alone; leave --error {error} out."
    )


def check(results: Path, scene: str | None) -> str:
    """Try the limits of advice.csv for one pressed scene, or all: with other times, and at contacts held out.

    InputError if there is no such scene, or nothing of it could be tried.
    """
    table, asked = (tables.read(results / "tables" / f"{name}.csv") for name in ("accuracy_vs_time", "advice"))
    pressed_scenes, known = tables.scenes(table), list(dict.fromkeys([*tables.scenes(table), *tables.scenes(asked)]))
    if scene is not None and scene not in known:
        raise InputError(f"--scene {scene} is not in {results}; choose from {', '.join(known)}.")
    if scene is not None and scene not in pressed_scenes:
        raise InputError(f"{_not_checked(scene)}; choose from {', '.join(pressed_scenes)}.")
    chosen = known if scene is None else [scene]
    return "\n".join(
        _checked(results, tables.where(table, scene=name), tables.where(asked, scene=name))
        if name in pressed_scenes
        else f"{_not_checked(name)}."
        for name in chosen
    )


def _not_checked(scene: str) -> str:
    return (
        f"{scene}: --check tries presses at contacts held out, and a scene that moves has none, so nothing was checked"
    )


def _checked(results: Path, rows: pd.DataFrame, asked: pd.DataFrame) -> str:
    """Try the limits ``asked`` for one pressed scene, and count what came of it."""
    errors = read_errors(results / "data", rows)
    budgets, most = (list(asked[column].dropna().unique()) for column in ("budget_ms", "max_error"))
    again = advised_again(rows, errors, {"budgets_ms": budgets, "max_errors": most})
    tried = tried_elsewhere(rows, errors, most)
    times = f"with each setting's times multiplied by {NOISE[0]:g} to {NOISE[1]:g}"
    said = (
        f"{rows['scene'].iloc[0]}: {times}, {again.same} of {again.rows} rows of advice name the same model, and "
        f"{again.as_good - again.same} another whose bound is no more than {100 * (EQUAL - 1):.0f} % larger"
    )
    if not tried.rows:
        why = "without these no model is advised for one" if most else "the run was asked for none"
        return f"{said}; no limit of error was tried at contacts held out, as {why}."
    return (
        f"{said}; of {tried.rows} limits of error tried at contacts held out, mean errors broke {tried.broken}; of "
        f"{tried.answers} answers there {tried.above} were above their limit; of {tried.rows} bounds {tried.over} were."
    )


def advise_any_load(
    results: Path, scene: str | None, load: str, budget_ms: float | None, max_error: float | None, error: str
) -> str:
    """Advise for one kind of ``load`` or all, in one scene of any_load.csv or all; InputError as ``advise``."""
    table = tables.read(results / "tables/any_load.csv")
    if scene is not None and scene not in tables.scenes(table):
        raise InputError(f"--scene {scene} is not in any_load.csv; choose from {', '.join(tables.scenes(table))}.")
    kinds = list(dict.fromkeys(table["kind"])) if load == "all" else [load.replace("-", " ")]
    pressed_rows, said = tables.read(results / "tables/accuracy_vs_time.csv"), []
    for name in tables.scenes(table) if scene is None else [scene]:
        rows, settings = (tables.where(found, scene=name) for found in (table, pressed_rows))
        own = other_loads.operator_error(settings, KINDS[error])
        for kind in kinds:
            said.append(any_load_lines(other_loads.advise_any_load(rows, kind, budget_ms, max_error, error, own)))
    return "\n".join(said)


def advise_force(results: Path, scene: str | None, limits: dict[str, Any]) -> str:
    """Advise by the error of the force of an instrument, in one scene or all; limits, InputError as ``advise``.

    Scenes are those of touch.csv, where without a limit it is what is nearest to the true force whatever time it takes,
    and those of dynamic_accuracy.csv in which an instrument touches a body that moves, whose limits are then those that
    the run was asked for.
    """
    paths = {name: results / f"tables/{name}.csv" for name in ("touch", "dynamic_accuracy")}
    there = [name for name, path in paths.items() if path.is_file()] or ["touch"]
    found = {name: tables.read(paths[name]) for name in there}
    if "dynamic_accuracy" in found:
        found["dynamic_accuracy"] = found["dynamic_accuracy"].dropna(subset="force_rms_of_peak")
    kinds = {each: name for name, table in found.items() for each in tables.scenes(table)}
    if scene is not None and scene not in kinds:
        raise InputError(f"--scene {scene} has no force of an instrument; choose from {', '.join(kinds)}.")
    budget, most = (limits.get(name, [None])[0] for name in ("budgets_ms", "max_errors"))
    said, refused = [], ""
    for name in kinds if scene is None else [scene]:
        rows = tables.where(found[kinds[name]], scene=name)
        if kinds[name] == "touch" and "speeds" not in limits:
            said.append(force_lines(advise_touch(rows, budget, most)))
        elif kinds[name] != "touch" and limits:
            advised = other_loads.advise_motion(rows, **limits, error="force", together=_together(limits))
            said.append(lines(advised.iloc[0], rows))
        elif kinds[name] != "touch":
            advised = other_loads.advise_motion(rows, **_asked(results, name), error="force")
            said.append(advice_list(advised, "force"))
        else:
            refused = f"--error force: {name} is pressed and does not move; leave --speed out."
    if refused and not said:
        raise InputError(refused)
    return "\n".join(said)


def _asked(results: Path, scene: str) -> dict[str, Any]:
    """Return the limits of a scene in advice.csv, by what is limited."""
    rows = tables.where(tables.read(results / "tables/advice.csv"), scene=scene)
    columns = {"budgets_ms": "budget_ms", "max_errors": "max_error", "speeds": "speed"}
    return {name: list(rows[column].dropna().unique()) for name, column in columns.items()}


def _of_scene(results: Path, scene: str, found: list[pd.DataFrame], limits: dict, kind: str) -> str:
    """Advise for one scene of accuracy_vs_time.csv, or of dynamic_accuracy.csv if it moves."""
    table = next(table for table in found if scene in tables.scenes(table))
    rows = tables.where(table, scene=scene)
    if "regime" not in table:
        return _of_motion(results, rows, limits, kind)
    if "speeds" in limits:
        raise _NoSuchLimit(f"{scene}: what is pressed and does not move has no speed; leave --speed out.")
    return lines(pressed.advise(rows, read_errors(results / "data", rows), **limits, kinds=[kind]).iloc[0])


def _of_motion(results: Path, rows: pd.DataFrame, limits: dict, kind: str) -> str:
    """Advise for one scene of dynamic_accuracy.csv, with its bounds if the run has them."""
    scene, path = rows["scene"].iloc[0], results / "tables/motion_bounds.csv"
    if kind != "rms":
        raise _NoSuchLimit(_no_patch(scene, kind))
    bounds = tables.where(tables.read(path), scene=scene) if path.is_file() else None
    pressed = tables.read(table) if (table := path.with_name("accuracy_vs_time.csv")).is_file() else None
    both = _together(limits)
    return lines(other_loads.advise_motion(rows, **limits, bounds=bounds, pressed=pressed, together=both).iloc[0], rows)


def _together(limits: dict) -> bool:
    """Return whether an error and a speed are asked for at once."""
    return {"max_errors", "speeds"} <= set(limits)


NOISE = (0.7, 1.4)
"""Factors between which the times of a setting change from run to run."""
RUNS = 10
SEED = 2
"""Of the noise and of the folds, which are others than those of a run."""
TIMES = ["online_median_s", "online_p95_s", "online_max_s"]


class Again(NamedTuple):
    """How many rows of advice were asked for again, named the same model, or that or one whose bound is as good."""

    rows: int
    same: int
    as_good: int


def advised_again(settings: pd.DataFrame, errors: pd.DataFrame, limits: dict[str, Any]) -> Again:
    """Advise RUNS times for one scene with all times of each setting multiplied by a factor of NOISE.

    settings, errors, limits : as ``advise`` takes them
    """
    random, first = np.random.default_rng(SEED), pressed.advise(settings, errors, **limits)
    rows = same = as_good = 0
    for _ in range(RUNS):
        noisy, factor = settings.copy(), random.uniform(*NOISE, len(settings))
        noisy[TIMES] = settings[TIMES].mul(factor, axis=0)
        for before, now in zip(first.itertuples(), pressed.advise(noisy, errors, **limits).itertuples(), strict=True):
            alike = before.model == now.model
            rows, same = rows + 1, same + alike
            as_good += alike or now.bound_of_peak <= EQUAL * before.bound_of_peak
    return Again(rows, same, as_good)


class Broken(NamedTuple):
    """What advised limits of error came to at contacts held out.

    rows, broken : how many limits had an advised model, and how many of these its mean error passed
    answers, above : how many single answers they gave, and how many of these passed it
    over : how many rows have a bound above their limit
    """

    rows: int
    broken: int
    answers: int
    above: int
    over: int


def tried_elsewhere(settings: pd.DataFrame, errors: pd.DataFrame, max_errors: list[float]) -> Broken:
    """Advise for one scene without a fold of the contacts, and try that on the fold; over all folds.

    Errors include the truth's own; presses that a model refuses to answer are none.
    settings, errors, max_errors : as ``advise`` takes them
    """
    contacts = np.unique(errors["contact"])
    fold = pd.Series(deal(contacts, SEED), index=contacts)
    counts = np.zeros(5, dtype=int)
    for kind in KINDS:
        held = Question(settings, errors, kind).held
        own = pd.Series(held.own, index=held.sample)
        for number in fold.unique():
            hidden = fold[fold == number].index
            question = Question(settings, errors[~errors["contact"].isin(hidden)], kind)
            there = errors[errors["contact"].isin(hidden)].drop_duplicates([*SETTING, "sample"]).set_index(SETTING)
            for row in ADVICE.frame([question.under(limit) for limit in max_errors]).itertuples():
                if row.model == NONE or (row.model, row.setting) not in there.index:
                    continue
                presses = there.loc[[(row.model, row.setting)]].dropna(subset=KINDS[kind])
                answers = presses[KINDS[kind]].to_numpy() + own.reindex(presses["sample"]).to_numpy()
                if len(answers):
                    above = answers > row.max_error
                    over = row.bound_of_peak > row.max_error
                    counts += [1, answers.mean() > row.max_error, len(answers), above.sum(), over]
    return Broken(*counts.tolist())
