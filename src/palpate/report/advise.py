"""Carry out ``palpate advise``: read the tables of a run, and say in words what to take."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from palpate.benchmark import advice as adviser
from palpate.benchmark.ranking import KINDS, read_errors
from palpate.errors import InputError
from palpate.report import tables
from palpate.report.advice_words import advice_list, lines


class Asked(NamedTuple):
    """What ``palpate advise`` is asked for.

    results : the folder of the run
    limits : lists by what is limited, one of each: budgets_ms, max_errors or speeds; none: what the run was asked for
    error : "rms", "patch" or "force", of an instrument
    load : a kind of load as the command names it, or "all"; empty: presses, touches and motions
    """

    results: Path
    limits: dict[str, Any]
    error: str = "rms"
    load: str = ""

    def table(self, name: str) -> pd.DataFrame | None:
        """Return a table of the run, None if it has none."""
        path = self.results / f"tables/{name}.csv"
        return tables.read(path) if path.is_file() else None

    @property
    def one(self) -> tuple[float | None, float | None]:
        """The time of an answer [ms] and the error, None: not limited."""
        return self.limits.get("budgets_ms", [None])[0], self.limits.get("max_errors", [None])[0]


class _NoSuchLimit(InputError):
    """A scene was asked for what it does not have: a patch, or a speed."""


def advise(asked: Asked, scene: str | None) -> str:
    """Advise for one scene, or for all that have what is asked for.

    InputError for tables that the run lacks, for a scene that they lack, and where no scene has such a limit.
    """
    ways = _ways(asked)
    found = {name: table for name in ways if (table := asked.table(name)) is not None}
    if asked.load and not found:
        raise InputError(f"{asked.results} has no any_load.csv; type make full, or give tradeoff an any_load.")
    found = found or {name: tables.read(asked.results / f"tables/{name}.csv") for name in list(ways)[:1]}
    if asked.error == "force" and "dynamic_accuracy" in found:
        found["dynamic_accuracy"] = found["dynamic_accuracy"].dropna(subset="force_rms_of_peak")
    known = {each: name for name, table in found.items() for each in tables.scenes(table)}
    if not known:
        raise InputError(
            f"no scene in {asked.results} is judged by force; leave --error force out, or type make touch."
        )
    if scene is not None and scene not in known:
        raise InputError(f"--scene {scene} is not in {asked.results}; choose from {', '.join(known)}.")
    said, advised = [], False
    for each in known if scene is None else [scene]:
        name = known[each]
        try:
            said.append(ways[name](asked, tables.where(found[name], scene=each)))
            advised = True
        except _NoSuchLimit as refusal:
            said.append(str(refusal))
    if not advised:  # nothing is there that has such a limit
        raise InputError(said[-1])
    return "\n".join(said)


def _ways(asked: Asked) -> dict[str, Callable[[Asked, pd.DataFrame], str]]:
    """Return what advises for a scene, by the table that has its rows."""
    if asked.error == "force":
        return {"touch": _touched, "dynamic_accuracy": _moved}
    if asked.load:
        return {"any_load": _loaded}
    return {"accuracy_vs_time": _pressed, "dynamic_accuracy": _moved} if asked.limits else {"advice": _listed}


def _listed(asked: Asked, rows: pd.DataFrame) -> str:
    """List the rows of advice.csv about a scene."""
    if asked.error not in set(rows["error"]):
        raise _no_patch(rows, asked)
    return advice_list(rows, asked.error)


def _no_patch(rows: pd.DataFrame, asked: Asked) -> _NoSuchLimit:
    return _NoSuchLimit(
        f"{rows['scene'].iloc[0]}: models of a scene that moves are judged over its surface and by force, and not "
        "where it is pressed, of which motion_truth.csv has the truth's own error alone; leave --error "
        f"{asked.error} out."
    )


def _no_speed(asked: Asked, rows: pd.DataFrame) -> None:
    """Raise InputError for a speed of what does not move."""
    if "speeds" in asked.limits:
        scene = rows["scene"].iloc[0]
        raise _NoSuchLimit(f"{scene}: what is pressed and does not move has no speed; leave --speed out.")


def _pressed(asked: Asked, rows: pd.DataFrame) -> str:
    _no_speed(asked, rows)
    errors: Any = read_errors(asked.results / "data", rows)
    return lines(adviser.advise(rows, errors, **asked.limits, kinds=[asked.error]).iloc[0])


def _loaded(asked: Asked, rows: pd.DataFrame) -> str:
    _no_speed(asked, rows)
    settings = tables.read(asked.results / "tables/accuracy_vs_time.csv")
    own = adviser.operator_error(tables.where(settings, scene=rows["scene"].iloc[0]), KINDS[asked.error])
    kinds = dict.fromkeys(rows["kind"]) if asked.load == "all" else [asked.load.replace("-", " ")]
    return "\n".join(lines(adviser.advise_any_load(rows, kind, *asked.one, asked.error, own)) for kind in kinds)


def _touched(asked: Asked, rows: pd.DataFrame) -> str:
    """Advise by the force of a touch; without a limit, what is nearest to the true one whatever time it takes."""
    _no_speed(asked, rows)
    return lines(adviser.advise_touch(rows, *asked.one))


def _moved(asked: Asked, rows: pd.DataFrame) -> str:
    """Advise for a scene that moves, without a limit for each that the run was asked for."""
    if asked.error == "patch":
        raise _no_patch(rows, asked)
    scene, limits = rows["scene"].iloc[0], asked.limits
    bounds, together = asked.table("motion_bounds"), {"max_errors", "speeds"} <= set(limits)
    if bounds is not None:
        bounds = tables.where(bounds, scene=scene)
    known: dict[str, Any] = {"bounds": bounds, "pressed": asked.table("accuracy_vs_time"), "error": asked.error}
    if limits:
        return lines(adviser.advise_motion(rows, **limits, **known, together=together).iloc[0], rows)
    before = tables.where(tables.read(asked.results / "tables/advice.csv"), scene=scene)
    columns = {"budgets_ms": "budget_ms", "max_errors": "max_error", "speeds": "speed"}
    limits = {name: list(before[column].dropna().unique()) for name, column in columns.items()}
    return advice_list(adviser.advise_motion(rows, **limits, **known), asked.error)
