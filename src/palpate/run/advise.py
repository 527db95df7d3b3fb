"""Carry out ``palpate advise``: read the tables of a run, and say in words what to take."""

from pathlib import Path

import pandas as pd

from palpate.benchmark import advice as pressed
from palpate.benchmark import advice_other_loads as other_loads
from palpate.benchmark.advice_trial import NOISE, advised_again, tried_elsewhere
from palpate.benchmark.comparison import read_errors
from palpate.errors import InputError
from palpate.report import tables
from palpate.report.advice_words import advice_list, any_load_lines, lines


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
        return advice_list(found[0][found[0]["scene"].isin(chosen)], error)
    return "\n".join(_of_scene(results, name, found, limits, error) for name in chosen)


def check(results: Path, scene: str | None) -> str:
    """Try the limits of advice.csv for one pressed scene, or all: with other times, and at contacts held out."""
    table, asked = (tables.read(results / "tables" / f"{name}.csv") for name in ("accuracy_vs_time", "advice"))
    said = []
    for name in tables.scenes(table):
        if scene not in (None, name):
            continue
        rows, of_scene = tables.where(table, scene=name), tables.where(asked, scene=name)
        errors = read_errors(results / "data", rows)
        budgets, most = (list(of_scene[column].dropna().unique()) for column in ("budget_ms", "max_error"))
        again = advised_again(rows, errors, {"budgets_ms": budgets, "max_errors": most})
        tried = tried_elsewhere(rows, errors, most)
        times = f"{NOISE[0]:g} to {NOISE[1]:g} times as long"
        said.append(
            f"{name}: of {again.rows} rows with times {times} {again.as_good} advise the same model ({again.same}) "
            f"or one whose bound is as good; of {tried.rows} limits of error tried at contacts held out {tried.broken} "
            f"were broken, and {tried.above} of {tried.answers} answers above them; {tried.over} bounds were above "
            "their limit"
        )
    return "\n".join(said)


def advise_any_load(
    results: Path, scene: str | None, load: str, budget_ms: float | None, max_error: float | None, error: str
) -> str:
    """Advise for one kind of ``load`` or all, in one scene of any_load.csv or all; InputError as ``advise``."""
    table = tables.read(results / "tables/any_load.csv")
    if scene is not None and scene not in tables.scenes(table):
        raise InputError(f"--scene {scene} is not in any_load.csv; choose from {', '.join(tables.scenes(table))}.")
    kinds = list(dict.fromkeys(table["kind"])) if load == "all" else [load.replace("-", " ")]
    return "\n".join(
        any_load_lines(other_loads.advise_any_load(tables.where(table, scene=name), kind, budget_ms, max_error, error))
        for name in tables.scenes(table)
        if scene in (None, name)
        for kind in kinds
    )


def _of_scene(results: Path, scene: str, found: list[pd.DataFrame], limits: dict, kind: str) -> str:
    """Advise for one scene of accuracy_vs_time.csv, or of dynamic_accuracy.csv if it moves."""
    table = next(table for table in found if scene in tables.scenes(table))
    rows = tables.where(table, scene=scene)
    if "regime" not in table:
        return _of_motion(results, rows, limits, kind)
    if "speeds" in limits:
        return f"{scene}: what is pressed and does not move has no speed; give --budget-ms"
    return lines(pressed.advise(rows, read_errors(results / "data", rows), **limits, kinds=[kind]).iloc[0])


def _of_motion(results: Path, rows: pd.DataFrame, limits: dict, kind: str) -> str:
    """Advise for one scene of dynamic_accuracy.csv, with its bounds if the run has them."""
    scene, path = rows["scene"].iloc[0], results / "tables/motion_bounds.csv"
    if kind != "rms":
        return f"{scene}: a scene that moves has no patch; leave --error {kind} out"
    bounds = tables.where(tables.read(path), scene=scene) if path.is_file() else None
    pressed = tables.read(table) if (table := path.with_name("accuracy_vs_time.csv")).is_file() else None
    return lines(other_loads.advise_motion(rows, **limits, bounds=bounds, pressed=pressed).iloc[0], rows)
