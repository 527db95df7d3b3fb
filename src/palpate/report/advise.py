"""Carry out ``palpate advise``: read the tables of a run, and say in words what to take."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark import advice as adviser
from palpate.benchmark.choosing import Limit
from palpate.benchmark.ranking import KINDS, read_errors
from palpate.errors import InputError
from palpate.report import tables
from palpate.report.advice_words import advice_list, lines

MOTIONS = "dynamic_accuracy"


class Asked(NamedTuple):
    """What ``palpate advise`` is asked for.

    results : the folder of the run
    limits : lists of one by what is limited: budgets_ms, max_errors or speeds; none: what the run was asked for
    error : "rms", "patch" or "force", of an instrument
    load : a kind of load as the command names it, or "all"; empty: presses, touches and motions
    """

    results: Path
    limits: dict[str, Any]
    error: str = "rms"
    load: str = ""

    @property
    def limit(self) -> Limit:
        """The time, the error and the speed that are asked for, NaN: not limited."""
        return Limit(*(self.limits.get(name, [np.nan])[0] for name in ("budgets_ms", "max_errors", "speeds")))

    @property
    def sources(self) -> list[str]:
        """The names of the tables that such advice follows from."""
        if self.error == "force":
            return ["touch", MOTIONS]
        if self.load:
            return ["any_load"]
        return ["accuracy_vs_time", MOTIONS] if self.limits else ["advice"]

    def table(self, name: str) -> pd.DataFrame | None:
        """Return a table of the run, None if it has none."""
        path = self.results / f"tables/{name}.csv"
        return tables.read(path) if path.is_file() else None


def advise(request: Asked, scene: str | None) -> str:
    """Advise for one scene, or for all that have what is asked for.

    InputError for tables that the run lacks, for a scene that they lack, and where no scene has such a limit.
    """
    if not request.results.is_dir():
        raise InputError(f"--results {request.results} is no folder; type make, which fills results, or give another.")
    measured = {name: table for name in request.sources if (table := request.table(name)) is not None}
    if request.load and not measured:
        remedy = "type make full and say --results .full/results, or give tradeoff an any_load"
        raise InputError(f"{request.results} has no any_load.csv; {remedy}.")
    measured = measured or {name: tables.read(request.results / f"tables/{name}.csv") for name in request.sources[:1]}
    if request.error == "force" and MOTIONS in measured:
        measured[MOTIONS] = measured[MOTIONS].dropna(subset="force_rms_of_peak")
    sources = {each: name for name, table in measured.items() for each in tables.scenes(table)}
    if not sources:
        raise InputError(
            f"no scene in {request.results} is judged by force; leave --error force out, or type make touch."
        )
    if scene is not None and scene not in sources:
        raise InputError(f"--scene {scene} is not in {request.results}; choose from {', '.join(sources)}.")
    rows = {each: tables.where(measured[sources[each]], scene=each) for each in ([scene] if scene else sources)}
    refusals = {each: text for each in rows if (text := _refusal(request, sources[each], rows[each]))}
    if len(refusals) == len(rows):
        raise InputError([*refusals.values()][-1])
    return "\n".join(refusals.get(each) or _advice(request, sources[each], rows[each]) for each in rows)


def _refusal(request: Asked, source: str, rows: pd.DataFrame) -> str:
    """Say that a scene cannot be advised on by patch or by speed, where ``request`` has that; empty otherwise."""
    scene = rows["scene"].iloc[0]
    if request.error == "patch" and (source == MOTIONS or (source == "advice" and "patch" not in set(rows["error"]))):
        return (
            f"{scene}: models of a scene that moves are judged over its surface and by force, and not where it is "
            "pressed, of which motion_truth.csv has the truth's own error alone; leave --error patch out."
        )
    if "speeds" in request.limits and source != MOTIONS:
        return f"{scene}: what is pressed and does not move has no speed; leave --speed out."
    return ""


def _advice(request: Asked, source: str, rows: pd.DataFrame) -> str:
    """Advise for one scene in words, from its ``rows`` of the table ``source``."""
    if source == "advice":
        return advice_list(rows, request.error)
    if source == "accuracy_vs_time":
        errors: Any = read_errors(request.results / "data", rows)
        return lines(adviser.advise(rows, errors, **request.limits, kinds=[request.error]).iloc[0])
    if source == "touch":  # without a limit, what is nearest to the true force whatever time it takes
        return lines(adviser.choice(adviser.touches(rows), request.limit))
    if source == "any_load":
        return _of_loads(request, rows)
    return _of_motion(request, rows)


def _of_loads(request: Asked, rows: pd.DataFrame) -> str:
    """Advise for the kind of load that is requested, or for each kind; InputError without a limit."""
    if not request.limits:
        raise InputError("advice for a kind of load needs a limit; give --max-error or --budget-ms.")
    settings = tables.read(request.results / "tables/accuracy_vs_time.csv")
    operator_error = adviser.operator_error(tables.where(settings, scene=rows["scene"].iloc[0]), KINDS[request.error])
    kinds = dict.fromkeys(rows["kind"]) if request.load == "all" else [request.load.replace("-", " ")]
    advice = (adviser.other_loads(rows, kind, request.error, operator_error) for kind in kinds)
    return "\n".join(lines(adviser.choice(each, request.limit)) for each in advice)


def _of_motion(request: Asked, rows: pd.DataFrame) -> str:
    """Advise for a scene that moves; if the request has no limit, for each limit in the run's advice.csv."""
    scene, bounds = rows["scene"].iloc[0], request.table("motion_bounds")
    if bounds is not None:
        bounds = tables.where(bounds, scene=scene)
    options: dict[str, Any] = {"bounds": bounds, "pressed": request.table("accuracy_vs_time"), "error": request.error}
    if request.limits:
        return lines(adviser.choice(adviser.motions(rows, **options), request.limit))
    advised = tables.where(tables.read(request.results / "tables/advice.csv"), scene=scene)
    columns = {"budgets_ms": "budget_ms", "max_errors": "max_error", "speeds": "speed"}
    limits: dict[str, Any] = {name: list(advised[column].dropna().unique()) for name, column in columns.items()}
    return advice_list(adviser.advise_motion(rows, **limits, **options), request.error)
