"""Carry out ``palpate ask``: from a scene's name in the settings, and perhaps its results, to a folder of questions."""

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from palpate.benchmark.judge import read_judged
from palpate.benchmark.model import FitOptions
from palpate.benchmark.presses import choose_presses, force_of
from palpate.benchmark.settings import finger_regimes, pressed_bodies, radius_of
from palpate.benchmark.split import FOLDS
from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_by_area
from palpate.bodies.make_body import make_body
from palpate.bodies.settings import paths_of_body
from palpate.errors import InputError, suggest
from palpate.exchange import presses
from palpate.exchange.asked_body import pictures
from palpate.exchange.folder import Questions, write
from palpate.exchange.readme import readme
from palpate.run.job import steps
from palpate.run.settings import complete
from palpate.run.settings_yaml import read_settings


def ask(config: Path, results: Path | None, scene: str, seed: int | None, out: Path) -> str:
    """Write the questions of ``scene`` to the folder ``out``, and return what they are.

    results : folder that make has filled; None is that beside ``config``
    seed : of a private set, without truths, drawn anew; None for the public set, the test presses of the results
    InputError for a scene that the settings do not have, and results that lack it.
    """
    settings = complete(read_settings(config), config)
    known = scenes(settings)
    if scene not in known:
        if not known:
            raise InputError(f"{config} presses no body; add tradeoff, as palpate init writes it.")
        raise InputError(f"--scene {scene} is not in {config}; {suggest(scene, list(known), 'choose from')}")
    if seed is not None and seed == settings["seed"]:
        raise InputError(f"--seed {seed} is that of {config}, whose presses are public; give another number.")
    where = config.parent / "results" if results is None else results
    body, questions, page = _press(settings, config, where, *known[scene], seed)
    pages = {"README.md": readme(questions, body.material.law, page), **pictures(body)}
    write(questions, out, pages)
    told = "with their truth" if questions.truth is not None else "without a truth"
    return (
        f"{out}: {questions.count} questions of {scene}, {told}, at {len(questions.points)} points; README.md says how "
        f"to answer them.\ndigest {questions.digest}"
    )


def scenes(settings: dict[str, Any]) -> dict[str, tuple[str, str]]:
    """Return body and regime of each scene that can be asked, by its name."""
    if "tradeoff" not in settings:
        return {}
    regimes = settings.get("regimes", {}) | finger_regimes(settings)
    return {f"{body}_{regime}": (body, regime) for body in pressed_bodies(settings) for regime in regimes}


def _press(
    settings: dict[str, Any], config: Path, results: Path, name: str, regime: str, seed: int | None
) -> tuple[Body, Questions, dict[str, str]]:
    radius_m = radius_of((settings["regimes"] | finger_regimes(settings))[regime], name)
    if seed is None:
        body, questions = public(settings, results / "data" / name, regime, radius_m)
    else:
        given = settings["bodies"][name]
        body = make_body(name, given | paths_of_body(given, config.parent))
        questions = private(
            body,
            settings,
            regime,
            radius_m,
            seed,
            steps(partial(print, file=sys.stderr, flush=True), "forces at contact"),
        )
    return body, questions, presses.page(questions)


def public(settings: dict[str, Any], folder: Path, regime: str, radius_m: float) -> tuple[Body, Questions]:
    """Return a body and the questions of its test presses of the first split with their truth, as ``make`` has them.

    folder : that of the body in the results
    """
    block, place = settings["tradeoff"], folder / regime
    files = {"body": folder / "body.h5", **{name: place / f"{name}.h5" for name in ("database", "truth")}}
    files["samples"] = place / "samples.csv"
    if lacks := [path for path in files.values() if not path.is_file()]:
        raise InputError(
            f"{lacks[0]} is missing; type make tradeoff first, or give --seed for questions without truths."
        )
    options = FitOptions(**block["regression"], split="contacts", seed=settings["seed"])
    given: tuple[Any, ...] = radius_m, options, settings["solver"]["tolerance"], {}
    case, judge = read_judged(files, regime, block["splits"][0], *given)
    rows = np.flatnonzero(judge.side == "test")
    asked = judge.numbers[rows], judge.samples.contact[rows], judge.samples.force[rows]
    questions = presses.questions_of(case.body, regime, radius_m, *asked)
    truth = presses.truth_arrays(judge.truth[rows], judge.own[rows], judge.own_seconds[rows])
    return case.body, replace(questions, truth=truth)


def private(
    body: Body, settings: dict[str, Any], regime: str, radius_m: float, seed: int, progress: Callable = iter
) -> Questions:
    """Return questions of as many presses as ``make`` tests, of contacts drawn by ``seed``."""
    block, rule = settings["tradeoff"], (settings["regimes"] | finger_regimes(settings))[regime]
    count = -(-block["contacts"] // FOLDS)
    # half of the contacts are the farthest from each other, whatever the seed: those drawn by area are taken
    able = contacts_by_area(body, count, seed)
    loads = choose_presses(body, 0, block["presses"], rule, radius_m, seed, progress, able.tolist())
    forces = np.array([force_of(load) for _, load in loads.iterrows()])
    return presses.questions_of(body, regime, radius_m, loads["sample"].to_numpy(), loads["contact"].to_numpy(), forces)
