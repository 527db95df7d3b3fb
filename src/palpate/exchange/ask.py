"""Carry out ``palpate ask``: from a scene's name in the settings, and perhaps its results, to a folder of questions."""

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from palpate.benchmark.comparable import followed
from palpate.benchmark.database import FOLDS
from palpate.benchmark.motion_truth import MotionTruth
from palpate.benchmark.moving_scene import MovingScene
from palpate.benchmark.presses import choose_presses, samples_in
from palpate.benchmark.settings import Instrument as ToolSettings
from palpate.benchmark.settings import instrument_name, pressed_bodies
from palpate.benchmark.touch import BEFORE, TOUCH_COLUMNS, TouchTruth, choose_touches, touches_of
from palpate.benchmark.touch_mesh import check_by_coarse_elements
from palpate.bodies.body import Body
from palpate.bodies.body_file import load
from palpate.bodies.contacts import contacts_by_area
from palpate.bodies.make_body import make_body
from palpate.bodies.material import LAWS
from palpate.effects.instrument import Instrument
from palpate.errors import InputError, suggest
from palpate.exchange import motions, presses, touches
from palpate.exchange.asked_body import FURTHER, formula, law_named, pictures, with_law
from palpate.exchange.folder import Questions, write
from palpate.files import read_table, templates
from palpate.run.job import steps
from palpate.run.settings import complete, read_settings
from palpate.setting_types import plain
from palpate.stores import stored


def ask(config: Path, results: Path | None, scene: str, seed: int | None, out: Path) -> str:
    """Write the questions of ``scene`` to the folder ``out``; return a sentence on them, which is printed.

    results : folder that make has filled; None is that beside ``config``
    seed : of a private set, without truths, drawn anew; None for the public set, the test presses of the results
    InputError for a scene that the settings do not have, and results that lack it.
    """
    settings = complete(read_settings(config), config)
    by_name = scenes(settings)
    if scene not in by_name:
        if not by_name:
            raise InputError(f"{config} presses no body; add tradeoff, as palpate init writes it.")
        raise InputError(f"--scene {scene} is not in {config}; {suggest(scene, list(by_name), 'choose from')}")
    if seed is not None and seed == settings.seed:
        raise InputError(f"--seed {seed} is that of {config}, whose presses are public; give another number.")
    run_folder = config.parent / "results" if results is None else results
    body, questions = by_name[scene](settings, config, run_folder, seed)
    if seed is not None:
        with_law(body, questions.info["law"])  # whose truth whoever scores has to find
    pages = {"README.md": readme(questions, body.material.law), **pictures(body)}
    write(questions, out, pages)
    with_truth = "with the truth" if questions.truth is not None else "without a truth"
    return (
        f"{out}: {questions.counted} of {scene}, {with_truth}, at {len(questions.points)} points; README.md says how "
        f"to answer them.\ndigest {questions.digest}"
    )


Asked = tuple[Body, Questions]


def scenes(settings: Any) -> dict[str, Callable[..., Asked]]:
    """Return the scenes of the settings, by name: functions that return a body and the questions about it."""
    by_name: dict[str, Callable[..., Asked]] = {}
    if settings.tradeoff is not None:
        for regime in settings.regimes:
            by_name |= {f"{body}_{regime}": partial(_presses, body, regime) for body in pressed_bodies(settings)}
    if settings.touch is not None:
        for tool in settings.touch.instruments:
            label = instrument_name(tool)
            by_name |= {f"{name}_{label}": partial(_touches, name, tool) for name in pressed_bodies(settings, "touch")}
    if settings.dynamic is not None:
        for name, motion in (settings.dynamic.scenes or {}).items():
            if motion.truth is not None and motion.truth.elements == "quadratic":
                by_name[name] = partial(_motions, name, motion)
    return by_name


def _presses(name: str, regime: str, settings: Any, config: Path, results: Path, seed: int | None) -> Asked:
    """Return the test presses of the first split of a run as questions, or as many at contacts drawn by ``seed``."""
    study, rule = settings.tradeoff, settings.regimes[regime]
    radius_m = rule.radius_on(name)
    if seed is None:
        place = results / "data" / name
        files = {"body": place / "body.h5", "samples": place / regime / "samples.csv"}
        files |= {each: place / regime / f"{each}.h5" for each in ("database", "truth")}
        _made("tradeoff", *files.values())
        return presses.of_run(files, regime, study.splits[0], radius_m)
    body, count = _body(settings, name, config), -(-study.contacts // FOLDS)
    # half of the contacts are the farthest from each other, whatever the seed: those drawn by area are taken
    contacts = contacts_by_area(body, count, seed)
    progress = steps(partial(print, file=sys.stderr, flush=True), "forces at contact")
    loads = choose_presses(body, 0, plain(study.presses), plain(rule), radius_m, seed, progress, contacts.tolist())
    return body, presses.questions_of(body, regime, samples_in(loads))


def _touches(name: str, tool: ToolSettings, settings: Any, config: Path, results: Path, seed: int | None) -> Asked:
    """Return the touches of a run whose truth is believed as questions, or as many drawn by ``seed``."""
    instrument, study = Instrument(**dict(tool)), settings.touch
    if seed is None:
        place = results / "data" / name / "touch" / instrument_name(tool)
        files = results / "data" / name / "body.h5", place / "touches.csv", place / "truth.h5"
        _made("touch", *files)
        body, table, truth = load(files[0]), read_table(files[1], TOUCH_COLUMNS), stored(TouchTruth, files[2])
        rows = np.flatnonzero(truth.believed)
        if not len(rows):
            raise InputError(f"{files[2]}: no touch has a truth that is believed; press less deep.")
        chosen = [touches_of(instrument, table)[row] for row in rows]
        questions = touches.questions_of(body, truth.sample[rows], chosen)
        return body, replace(questions, truth=touches.truth_arrays(truth, rows))
    body = _body(settings, name, config)
    has_answer = check_by_coarse_elements(body, study.truth.along_radius)
    table = choose_touches(body, instrument, study.samples, tuple(study.depth_of_radius), seed, has_answer)
    return body, touches.questions_of(body, table["sample"].to_numpy(), touches_of(instrument, table))


def _motions(name: str, motion: Any, settings: Any, config: Path, results: Path, seed: int | None) -> Asked:
    """Return the motion of a run as a question, or one drawn by ``seed``."""
    entry = settings.scenes[name].but(name=name)
    course = motion.duration_s or followed(entry), motion.frames or settings.dynamic.frames, motion.level
    found_by = {"levels": motion.truth.levels, "steps_per_frame": motion.truth.steps_per_frame}
    if seed is not None:
        scene = MovingScene.of(entry, _body(settings, entry.body, config), *course)
        return scene.body, motions.questions_of([motions.drawn(scene, seed)], found_by)
    body_file, truth_file = results / "data" / entry.body / "body.h5", results / "data/dynamic" / name / "truth.h5"
    _made("dynamic", body_file, truth_file)
    scene, truth = MovingScene.of(entry, load(body_file), *course), stored(MotionTruth, truth_file)
    if truth.rejected:
        raise InputError(f"{truth_file} has no truth that is believed ({truth.rejected}); ask for another scene.")
    questions = replace(motions.questions_of([scene], found_by), truth=motions.truth_arrays([truth]))
    if truth.displacement.shape[:2] != (*questions.frames, len(questions.points)):
        raise InputError(f"{truth_file} is of other settings than {config}; type make dynamic.")
    return scene.body, questions


def _made(target: str, *files: Path) -> None:
    """Raise InputError for a file of a run that is missing, which ``make target`` writes."""
    if lacks := [path for path in files if not path.is_file()]:
        raise InputError(
            f"{lacks[0]} is missing; type make {target} first, or give --seed for questions without truths."
        )


def _body(settings: Any, name: str, config: Path) -> Body:
    return make_body(name, settings.bodies[name].seen_from(config.parent))


def readme(questions: Questions, law: str) -> bytes:
    """Return README.md of a folder of questions, which suffices for who knows nothing of palpate.

    law : the body's, a name or a file
    """
    environment = templates(Path(__file__).parent / "pages")
    others = {name: formula(law_named(name)) for name in (*LAWS, *FURTHER) if name != questions.info["law"]}
    names = {"questions": questions, "info": questions.info, "formula": formula(law), "others": others}
    return environment.get_template(f"{questions.kind}.md").render(names | {"before": BEFORE}).encode()
