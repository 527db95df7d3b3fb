"""Settings of measured bodies."""

import warnings
from functools import partial
from pathlib import Path

import numpy as np

from palpate.bodies.make_body import make_body
from palpate.bodies.settings import check_laws
from palpate.errors import InputError, suggest
from palpate.files import check_file
from palpate.setting_types import (
    Block,
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
from palpate.studies.measured.experiment import check_places, experiment_of, off_box
from palpate.studies.measured.records import check_down, follow


class Load(Block):
    weight_n: Positive = optional("Weight [N] of what hangs there and moves along")
    force_n: Vector = optional("Force [N] in the body's frame, without a mass")
    line_m: Pair[Vector] = optional("Ends [m] of the line over which it is spread evenly")
    at_m: Vector = optional("Place [m] in the body's frame")
    radius_m: NotNegative = key("Radius [m] of the disc around at_m; 0 is a point, where no mesh has an answer", 0)


class Case(Block):
    loads: list[Load] = key("Weights and forces beside the body's own weight, on a line or on a disc", [])
    files: Distinct[Text] = key("CSV files of times and markers, one a repeat; none for a prediction alone", [])
    swings: Switch = key("Whether it swings after the release: a frequency and a damping ratio are compared", True)


class Marker(Block):
    at_m: Vector = key("Place [m] in the body's frame")
    fixed: Switch = key("Whether it is on what does not move, and so is not compared", False)


class ExperimentSettings(Block):
    body: str = key("One of bodies; its young_pa is the modulus that is given")
    gravity_m_s2: Positive = key("Acceleration of gravity [m/s²]", 9.81)
    down: Vector = key("Direction of gravity in the frame of the files, or, without files, of the body", [0, 0, -1])
    markers: dict[str, Marker] = key("Markers by name, as the columns of the files call them", min_length=3)
    calibrate_on: str | None = key("The case that Young's modulus is fitted to; null takes it as given", None)
    held_s: Positive = key("Time at the beginning of each file in which the body is held [s]", 0.4)
    settled_s: Positive = key("Time at the end of each file in which it has come to rest [s]", 1.0)
    cases: dict[Name, Case] = key("Cases by name, each the body under gravity and other loads", min_length=1)


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
    step_s: Positive = key("Time step [s]", 0.01)
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


class Settings(Block):
    """Models beside measured bodies: where markers come to rest, and how they swing after a release."""

    experiments: dict[Name, ExperimentSettings] = key(
        "Bodies held straight, let go, and at rest under loads", min_length=1
    )
    models: Models = key("Which models predict every experiment, and with what settings", {})


def check(config: dict, file: Path) -> None:
    """Raise InputError, before anything runs, for a body, level, law, place or file that there is not or does not fit.

    Places are looked at here on a box; on other bodies, which take longer to make, when models are put beside them.
    """
    models = config["measured"]["models"]
    check_laws(f"{file}: measured.models.fem_p2.laws", models["fem_p2"]["laws"], file.parent)
    for name, entry in config["measured"]["experiments"].items():
        place = f"{file}: measured.experiments.{name}"
        body = config["bodies"].get(entry["body"])
        if body is None:
            near = suggest(entry["body"], list(config["bodies"]), "choose from bodies:")
            raise InputError(f"{place}.body is {entry['body']}, which is not in bodies; {near}")
        if body["kind"] == "sheet":
            raise InputError(f"{place}.body is {entry['body']}, a sheet; name a body of tetrahedra.")
        _check_levels(f"{file}: measured.models", models, entry["body"], body["refinements"] + 1)
        try:
            experiment = experiment_of(name, entry)
            if body["kind"] == "box":
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")  # the job that makes the body warns
                    made = make_body(entry["body"], body | {"refinements": 0})
                check_places(experiment, made, partial(off_box, np.array(body["sizes_m"], dtype=float)))
        except InputError as error:
            raise InputError(f"{file}: {error}") from error
        for case in experiment.cases:
            for path in case.files:
                key = f"{place}.cases.{case.name}.files"
                check_file(key, path, (file.parent / path).is_file())
                try:
                    check_down(follow(str(file.parent / path), experiment), case, experiment, path)
                except InputError as error:
                    raise InputError(f"{key}: {error}") from error


def _check_levels(place: str, models: dict, body: str, levels: int) -> None:
    """Raise InputError for a level that a body does not have; quadratic elements need one more."""
    asked = {"fem_p1": 0, "fem_p2": 1, "springs": 0}
    wanted = [(f"{m}.levels", level, more) for m, more in asked.items() for level in models[m]["levels"] or []]
    for part, level, more in [*wanted, ("releases.level", models["releases"]["level"], 0)]:
        if level + more >= levels:
            raise InputError(
                f"{place}.{part} names level {level}, and the body {body} has levels 0 to {levels - 1}"
                f"{', of which quadratic elements leave out the last' if more else ''}; "
                f"choose another, or give bodies.{body} more refinements."
            )
