"""Carry out ``palpate ask``: from a scene's name in the settings, and perhaps its results, to a folder of questions."""

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from palpate.benchmark.comparable import followed
from palpate.benchmark.motion_truth import MotionTruth
from palpate.benchmark.moving_scene import MovingScene
from palpate.benchmark.presses import choose_presses, force_of
from palpate.benchmark.settings import Instrument as ToolSettings
from palpate.benchmark.settings import instrument_name, pressed_bodies
from palpate.benchmark.split import FOLDS
from palpate.benchmark.touch import TOUCH_COLUMNS, choose_touches, touches_of
from palpate.benchmark.touch_mesh import bearing
from palpate.benchmark.touch_truth import TouchTruth
from palpate.bodies.body import Body
from palpate.bodies.body_file import load
from palpate.bodies.contacts import contacts_by_area
from palpate.bodies.make_body import make_body
from palpate.effects.instrument import Instrument
from palpate.errors import InputError, suggest
from palpate.exchange import motions, presses, touches
from palpate.exchange.asked_body import pictures, with_law
from palpate.exchange.folder import Questions, write
from palpate.exchange.readme import readme
from palpate.files import read_table
from palpate.run.job import steps
from palpate.run.settings import complete, read_settings
from palpate.setting_types import plain
from palpate.stores import stored


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
    if seed is not None and seed == settings.seed:
        raise InputError(f"--seed {seed} is that of {config}, whose presses are public; give another number.")
    where = config.parent / "results" if results is None else results
    body, questions, page = known[scene](settings, config, where, seed)
    if seed is not None:
        with_law(body, questions.info["law"])  # whose truth whoever scores has to find
    pages = {"README.md": readme(questions, body.material.law, page), **pictures(body)}
    write(questions, out, pages)
    told = "with the truth" if questions.truth is not None else "without a truth"
    return (
        f"{out}: {questions.counted} of {scene}, {told}, at {len(questions.points)} points; README.md says how "
        f"to answer them.\ndigest {questions.digest}"
    )


Asked = tuple[Body, Questions, dict[str, str]]


def scenes(settings: Any) -> dict[str, Callable[..., Asked]]:
    """Return what asks about each scene that can be asked, by its name."""
    found: dict[str, Callable[..., Asked]] = {}
    if settings.tradeoff is not None:
        for regime in settings.regimes:
            found |= {f"{body}_{regime}": partial(_press, body, regime) for body in pressed_bodies(settings)}
    if settings.touch is not None:
        for tool in settings.touch.instruments:
            called = instrument_name(tool)
            found |= {f"{name}_{called}": partial(_touch, name, tool) for name in pressed_bodies(settings, "touch")}
    if settings.dynamic is not None:
        for name, own in (settings.dynamic.scenes or {}).items():
            if own.truth is not None and own.truth.elements == "quadratic":
                found[name] = partial(_motion, name, own)
    return found


def _press(name: str, regime: str, settings: Any, config: Path, results: Path, seed: int | None) -> Asked:
    radius_m = settings.regimes[regime].radius_on(name)
    if seed is None:
        body, questions = public(settings, results / "data" / name, regime, radius_m)
    else:
        body = _body(settings, name, config)
        questions = private(
            body,
            settings,
            regime,
            radius_m,
            seed,
            steps(partial(print, file=sys.stderr, flush=True), "forces at contact"),
        )
    return body, questions, presses.page(questions)


def _touch(name: str, tool: ToolSettings, settings: Any, config: Path, results: Path, seed: int | None) -> Asked:
    instrument, asked = Instrument(**dict(tool)), settings.touch
    if seed is None:
        place = results / "data" / name / "touch" / instrument_name(tool)
        files = [results / "data" / name / "body.h5", place / "touches.csv", place / "truth.h5"]
        if lacks := [path for path in files if not path.is_file()]:
            raise InputError(
                f"{lacks[0]} is missing; type make touch first, or give --seed for questions without truths."
            )
        body, table, truth = load(files[0]), read_table(files[1], TOUCH_COLUMNS), stored(TouchTruth, files[2])
        rows = np.flatnonzero(truth.believed)
        chosen = [touches_of(instrument, table)[row] for row in rows]
        if not chosen:
            raise InputError(f"{files[2]}: no touch has a truth that is believed; press less deep.")
        questions = replace(
            touches.questions_of(body, truth.sample[rows], chosen), truth=touches.truth_arrays(truth, rows)
        )
    else:
        body = _body(settings, name, config)
        bears = bearing(body, asked.truth.along_radius)
        table = choose_touches(body, instrument, asked.samples, tuple(asked.depth_of_radius), seed, bears)
        questions = touches.questions_of(body, table["sample"].to_numpy(), touches_of(instrument, table))
    return body, questions, touches.page(questions)


def _motion(name: str, own: Any, settings: Any, config: Path, results: Path, seed: int | None) -> Asked:
    entry = settings.scenes[name].but(name=name)
    asked = own.duration_s or followed(entry), own.frames or settings.dynamic.frames, own.level
    assert own.truth is not None  # as scenes says
    found_by = {"levels": own.truth.levels, "steps_per_frame": own.truth.steps_per_frame}
    if seed is not None:
        scene = MovingScene.of(entry, _body(settings, entry.body, config), *asked)
        drawn = motions.questions_of([motions.drawn(scene, seed)], found_by)
        return scene.body, drawn, motions.page(drawn)
    body_file, truth_file = results / "data" / entry.body / "body.h5", results / "data/dynamic" / name / "truth.h5"
    if lacks := [path for path in (body_file, truth_file) if not path.is_file()]:
        raise InputError(
            f"{lacks[0]} is missing; type make dynamic first, or give --seed for questions without truths."
        )
    scene, truth = MovingScene.of(entry, load(body_file), *asked), stored(MotionTruth, truth_file)
    if truth.rejected:
        raise InputError(f"{truth_file} has no truth that is believed ({truth.rejected}); ask for another scene.")
    questions = replace(motions.questions_of([scene], found_by), truth=motions.truth_arrays([truth]))
    if truth.displacement.shape[:2] != (*questions.frames, len(questions.points)):
        raise InputError(f"{truth_file} is of other settings than {config}; type make dynamic.")
    return scene.body, questions, motions.page(questions)


def _body(settings: Any, name: str, config: Path) -> Body:
    return make_body(name, settings.bodies[name].seen_from(config.parent))


def public(settings: Any, folder: Path, regime: str, radius_m: float) -> tuple[Body, Questions]:
    """Return a body and the questions of its test presses of the first split with their truth, as ``make`` has them.

    folder : that of the body in the results
    """
    place = folder / regime
    files = {"body": folder / "body.h5", **{name: place / f"{name}.h5" for name in ("database", "truth")}}
    files["samples"] = place / "samples.csv"
    if lacks := [path for path in files.values() if not path.is_file()]:
        raise InputError(
            f"{lacks[0]} is missing; type make tradeoff first, or give --seed for questions without truths."
        )
    return presses.of_run(files, regime, settings.tradeoff.splits[0], radius_m)


def private(body: Body, settings: Any, regime: str, radius_m: float, seed: int, progress: Callable = iter) -> Questions:
    """Return questions of as many presses as ``make`` tests, of contacts drawn by ``seed``."""
    asked, rule = settings.tradeoff, settings.regimes[regime]
    count = -(-asked.contacts // FOLDS)
    # half of the contacts are the farthest from each other, whatever the seed: those drawn by area are taken
    able = contacts_by_area(body, count, seed)
    loads = choose_presses(body, 0, plain(asked.presses), plain(rule), radius_m, seed, progress, able.tolist())
    forces = np.array([force_of(load) for _, load in loads.iterrows()])
    return presses.questions_of(body, regime, radius_m, loads["sample"].to_numpy(), loads["contact"].to_numpy(), forces)
