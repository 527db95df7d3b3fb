"""Settings of measured bodies."""

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError

from palpate.benchmark.settings import Instrument
from palpate.bodies.make_body import make_body
from palpate.bodies.settings import Body, check_laws
from palpate.errors import InputError, suggest
from palpate.files import check_file
from palpate.identification.relaxation import holds_of
from palpate.setting_types import (
    Block,
    Count,
    Distinct,
    Index,
    Name,
    NotNegative,
    Pair,
    Poisson,
    Positive,
    Switch,
    Text,
    Vector,
    key,
    optional,
)  # fmt: skip
from palpate.studies.measured.check_places import check_places
from palpate.studies.measured.records import follow, presses_of


class Load(Block):
    """A force on a part of the surface: on the line between two points, or on a disc."""

    weight_n: Positive | None = optional("Weight [N] of what hangs there and moves along")
    force_n: Vector | None = optional("Force [N] in the body's frame, without a mass")
    line_m: Pair[Vector] | None = optional("Ends [m] of the line over which it is spread evenly")
    at_m: Vector | None = optional("Place [m] in the body's frame")
    radius_m: NotNegative = key("Radius [m] of the disc around at_m; 0 is a point, where no mesh has an answer", 0)


def _consistent_load(load: Load) -> Load:
    if (load.force_n is None) == (load.weight_n is None):
        raise PydanticCustomError("load", "give either weight_n, of what hangs there, or force_n")
    if (load.line_m is None) == (load.at_m is None):
        raise PydanticCustomError("load", "give either line_m, the ends of an edge, or at_m, a point")
    if load.line_m is not None and load.radius_m > 0.0:
        raise PydanticCustomError("load", "leave out radius_m, which belongs to at_m and not to line_m")
    return load


class Case(Block):
    loads: list[Annotated[Load, AfterValidator(_consistent_load)]] = key(
        "Weights and forces beside the body's own weight, on a line or on a disc", []
    )
    files: Distinct[Text] = key("CSV files of times and markers, one a repeat; none for a prediction alone", [])
    swings: Switch = key("Whether it swings after the release: a frequency and a damping ratio are compared", True)


class Marker(Block):
    at_m: Vector = key("Place [m] in the body's frame")
    fixed: Switch = key("Whether it is on what does not move, and so is not compared", False)


class ExperimentSettings(Block):
    """A body that is released from its held state under gravity and loads, in several cases."""

    body: str = key("One of bodies; its young_pa is the modulus that is given")
    down: Vector = key("Direction of gravity in the frame of the files, or, without files, of the body", [0, 0, -1])
    markers: dict[str, Marker] = key("Markers by name, as the columns of the files call them", min_length=3)
    calibrate_on: str | None = key("The case that Young's modulus is fitted to; null takes it as given", None)
    held_s: Positive = key("Time at the beginning of each file in which the body is held [s]", 0.4)
    settled_s: Positive = key("Time at the end of each file in which it has come to rest [s]", 1.0)
    cases: dict[Name, Case] = key("Cases by name, each the body under gravity and other loads", min_length=1)


def _consistent_experiment(experiment: ExperimentSettings) -> ExperimentSettings:
    if all(marker.fixed for marker in experiment.markers.values()):
        raise PydanticCustomError("markers", "markers are all fixed; leave fixed out of those on what moves")
    if not any(experiment.down):
        raise PydanticCustomError("down", "give down the direction of gravity in the frame of the files")
    measured = [name for name, case in experiment.cases.items() if case.files]
    if experiment.calibrate_on not in (None, *measured):
        known = {"on": experiment.calibrate_on, "known": ", ".join(measured) or "none has files"}
        message = "calibrate_on is {on}, which is no case with files; choose from {known}, or null"
        raise PydanticCustomError("calibrate_on", message, known)
    return experiment


class FemP1(Block):
    levels: Distinct[Index] | None = key("Levels of the body's mesh; null for all that it has", None)


class FemP2(Block):
    levels: Distinct[Index] | None = key("Levels of the body's mesh that have a finer one; null for all of these", None)
    poissons: Distinct[Poisson] = key("Poisson's ratios beside the body's own, on the coarsest level", [0.45])
    laws: Distinct[Text] = key(
        "Laws beside the body's own, on the coarsest level, by name, or as paths of Python files of your own, "
        "relative to the folder of the config file",
        ["stable_neo_hookean", "neo_hookean", "st_venant_kirchhoff"],
    )


class Springs(Block):
    levels: Distinct[Index] = key("Levels whose edges are springs", [0])


class Creep(Block):
    duration_s: Positive = key("How long it is followed [s]", 3.0)


class Releases(Block):
    level: Index = key("Level", 0)
    steps_s: Distinct[Positive] = key("Time steps [s]", [0.001, 0.002, 0.005])
    duration_s: Positive = key("How long each release is followed [s]", 1.0)
    creep: Creep | None = key(
        "A release with a prony branch fitted to the creep of the calibrated case; null: none", {}
    )


class Models(Block):
    fem_p1: FemP1 = key("Linear elements", {})
    fem_p2: FemP2 = key("Quadratic elements", {})
    springs: Springs = key("Springs on the edges of tetrahedra, of the body's modulus", {})
    releases: Releases = key("Releases with linear elements and backward Euler, to show what that damps", {})


def _rising(ends: list[float]) -> list[float]:
    if ends[0] > ends[1]:
        raise PydanticCustomError("range", "give the least and the largest")
    return ends


RISING = AfterValidator(_rising)


class Presses(Block):
    files: Distinct[Text] = key("CSV files of presses, a row a point", min_length=1)
    columns: dict[Text, Text | list[Text]] = key(
        "Names that the files have for columns that are read, by these; of several, the cells are joined by a space", {}
    )
    names: str = key("Regular expression with groups session, specimen or place, that names of presses hold", "")
    leave_out: Distinct[Text] = key("Presses that are not read", [])
    instrument: Instrument | None = key("What is pressed in; null if it is not known: relaxation alone follows", None)
    body: str | None = key("One of bodies that is pressed; null for a slab", None)
    thickness_m: Annotated[Pair[NotNegative], RISING] | None = key(
        "Least and largest thickness of the slab [m]; null for a half-space", None
    )
    poisson: Annotated[Pair[Annotated[NotNegative, Field(lt=0.5)]], RISING] = key(
        "Least and largest Poisson's ratio", [0.3, 0.49]
    )
    sticking: Annotated[Pair[Annotated[NotNegative, Field(le=1)]], RISING] = key(
        "Least and largest share of what is touched that sticks to the instrument", [0, 1]
    )
    ask: Distinct[Literal["elastic", "relaxation"]] = key("What is identified", ["elastic", "relaxation"], min_length=1)
    laws: Distinct[Literal["neo_hookean", "exponential", "stable_neo_hookean"]] = key(
        "Laws that are fitted, each with moduli alone, but exponential with its stiffening, too",
        ["neo_hookean", "exponential"],
        min_length=1,
    )
    held_out: Distinct[Literal["place", "depth", "session", "specimen"]] = key(
        "What is left out of the fit and predicted", ["place", "depth", "session", "specimen"]
    )
    branches: Distinct[Count] = key("How many branches of relaxation are tried", [1, 2, 3, 4], min_length=1)
    draws: Count = key("How often data are drawn anew for the intervals of branches", 40)


def _consistent_presses(presses: Presses) -> Presses:
    if presses.body is not None and presses.thickness_m is not None:
        raise PydanticCustomError("pressed", "it has both body and thickness_m; leave out the thickness")
    if "elastic" in presses.ask and (presses.instrument is None or presses.instrument.kind != "sphere"):
        message = "ask has elastic, and forces are known for a sphere; describe it as the instrument, or ask for "
        raise PydanticCustomError("pressed", message + "relaxation alone")
    return presses


class Settings(Block):
    """Models beside measured bodies: where markers come to rest, how they swing, and what presses determine."""

    model_config = ConfigDict(json_schema_extra={"anyOf": [{"required": ["experiments"]}, {"required": ["presses"]}]})

    experiments: dict[Name, Annotated[ExperimentSettings, AfterValidator(_consistent_experiment)]] = key(
        "Bodies held straight, let go, and at rest under loads", {}
    )
    presses: dict[Name, Annotated[Presses, AfterValidator(_consistent_presses)]] = key("Tissue that was pressed", {})
    models: Models = key("Which models predict every experiment, and with what settings", {})


def check(config: Any, file: Path) -> None:
    """Raise InputError for bodies, levels, laws, places and files that are missing or do not fit, before anything runs.

    Places are checked here on a box only, and on other bodies, which take longer to make, by the job itself.
    """
    bodies, models = config.bodies, config.measured.models
    for name, entry in config.measured.presses.items():
        _check_presses(bodies, file, f"{file}: measured.presses.{name}", entry)
    check_laws(f"{file}: measured.models.fem_p2.laws", models.fem_p2.laws, file.parent)
    for name, entry in config.measured.experiments.items():
        place = f"{file}: measured.experiments.{name}"
        body = _body(bodies, place, entry.body)
        _check_levels(f"{file}: measured.models", models, entry.body, body.refinements + 1)
        try:
            if body.kind == "box":
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")  # the job that makes the body warns
                    coarse = make_body(entry.body, body.but(refinements=0))
                check_places(name, entry, coarse)
        except InputError as error:
            raise InputError(f"{file}: {error}") from error
        for case_name, case in entry.cases.items():
            for path in case.files:
                files = f"{place}.cases.{case_name}.files"
                check_file(files, path, (file.parent / path).is_file())
                try:
                    record = follow(str(file.parent / path), entry)
                except InputError as error:
                    raise InputError(f"{files}: {error}") from error
                sunk = float(record.moves.mean(axis=0) @ record.down)
                if sunk < 0.0 and all(load.force_n is None for load in case.loads):
                    raise InputError(
                        f"{files}: {path}: the markers rise by {-sunk:.3g} m against down, {entry.down}, and no force "
                        "lifts them; give the direction of gravity in the frame of the files."
                    )


def _body(bodies: Mapping[str, Body], place: str, name: str) -> Any:
    """Return the settings of a body of tetrahedra; InputError for another name."""
    if name not in bodies:
        near = suggest(name, list(bodies), "choose from bodies:")
        raise InputError(f"{place}.body is {name}, which is not in bodies; {near}")
    if bodies[name].kind == "sheet":
        raise InputError(f"{place}.body is {name}, a sheet; name a body of tetrahedra.")
    return bodies[name]


def _check_presses(bodies: Mapping[str, Body], file: Path, place: str, entry: Presses) -> None:
    """Raise InputError for an entry of ``measured.presses`` with a body or files that do not fit."""
    for path in entry.files:
        check_file(f"{place}.files", path, (file.parent / path).is_file())
    if entry.body is not None:
        _body(bodies, place, entry.body)
    try:
        records = presses_of(entry, file.parent)
        if "relaxation" in entry.ask:
            holds, refused = holds_of(records)
            if not holds:
                raise InputError(f"ask has relaxation, and {refused[0]}")
    except InputError as error:
        raise InputError(f"{place}: {error}") from error


def _check_levels(place: str, models: Models, body: str, levels: int) -> None:
    """Raise InputError for a level that a body does not have; quadratic elements need one more."""
    settings = (("fem_p1", models.fem_p1, 0), ("fem_p2", models.fem_p2, 1), ("springs", models.springs, 0))
    wanted = [(f"{name}.levels", level, finer) for name, block, finer in settings for level in block.levels or []]
    for setting, level, finer in [*wanted, ("releases.level", models.releases.level, 0)]:
        if level + finer >= levels:
            raise InputError(
                f"{place}.{setting} names level {level}, and the body {body} has levels 0 to {levels - 1}"
                f"{', of which quadratic elements leave out the last' if finer else ''}; "
                f"choose another, or give bodies.{body} more refinements."
            )
