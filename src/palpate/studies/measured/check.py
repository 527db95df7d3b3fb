"""Check of the settings of measured bodies."""

import warnings
from functools import partial
from pathlib import Path

import numpy as np

from palpate.bodies.make_body import make_body
from palpate.errors import InputError, suggest
from palpate.files import check_file
from palpate.studies.law.check import check_laws
from palpate.studies.measured.experiment import Experiment, check_places, experiment_of, off_box
from palpate.studies.measured.records import check_down, follow


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
            _check_places(experiment, entry["body"], body)
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


def _check_places(experiment: Experiment, name: str, entry: dict) -> None:
    if entry["kind"] == "box":
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the job that makes the body warns
            body = make_body(name, entry | {"refinements": 0})
        check_places(experiment, body, partial(off_box, np.array(entry["sizes_m"], dtype=float)))


def _check_levels(place: str, models: dict, body: str, levels: int) -> None:
    """Raise InputError for a level that a body does not have; quadratic elements need one more."""
    asked = {"fem_p1": 0, "fem_p2": 1, "springs": 0}
    wanted = [(f"{model}.levels", models[model]["levels"] or [], more) for model, more in asked.items()]
    wanted.append(("releases.level", [models["releases"]["level"]], 0))
    for key, chosen, more in wanted:
        for level in chosen:
            if level + more >= levels:
                raise InputError(
                    f"{place}.{key} names level {level}, and the body {body} has levels 0 to {levels - 1}"
                    f"{', of which quadratic elements leave out the last' if more else ''}; "
                    f"choose another, or give bodies.{body} more refinements."
                )
