"""Carry out ``palpate advise``: read the tables of a run, and say in words what to take."""

from pathlib import Path
from typing import Any

import pandas as pd

from palpate.benchmark import advice as pressed
from palpate.benchmark import advice_other_loads as other_loads
from palpate.benchmark.ranking import KINDS, read_errors
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
