"""Carry out ``palpate export``: from a scene's name in the settings to a file."""

import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from palpate.benchmark.model import Case
from palpate.benchmark.settings import pressed_bodies
from palpate.bodies.make_body import make_body
from palpate.effects.instrument import Instrument
from palpate.errors import InputError, NotConverged, suggest
from palpate.models.model_registry import MODELS
from palpate.press.portable.export import COLUMNS, export_model
from palpate.press.portable.file import describe
from palpate.press.portable.touches import Touches
from palpate.run.job import steps
from palpate.run.settings import complete, read_settings

CAN = "contact_modes"
"""The model that a file can hold."""


def export(
    config: Path,
    scene: str,
    model: str,
    contacts: int,
    out: Path,
    instruments: Sequence[Instrument] = (),
    places: int = 4,
) -> str:
    """Write a model of a scene of the settings ``config`` to the file ``out``, and return what it is.

    instruments : rigid ones, each prepared at so many ``places``
    InputError for a scene that the settings do not have, a model that a file cannot hold, and no place for the file.
    """
    if model != CAN:
        reason = "is not known" if model not in MODELS else "has no form that other programs can answer from"
        raise InputError(f"--model {model} {reason}; export {CAN}.")
    _refuse_place(out)
    settings = complete(read_settings(config), config)
    case = _case(settings, config, scene)
    from threadpoolctl import threadpool_limits

    say = partial(print, file=sys.stderr, flush=True)
    try:
        with threadpool_limits(limits=1):  # products are small, and threads wait for each other
            touches = Touches(instruments, places) if instruments else None
            nodes = settings.tradeoff.settings.contact_modes.nodes
            export_model(case, COLUMNS.having(nodes=nodes), contacts, out, lambda what: steps(say, what), touches)
    except NotConverged as failure:
        raise InputError(f"{scene} cannot be exported: {failure}; press less hard, or refine the body.") from failure
    except OSError as error:
        raise InputError(f"{out} cannot be written ({error.strerror}); give another file with --out.") from error
    return describe(out)


def _refuse_place(out: Path) -> None:
    """Raise InputError for a file that cannot be written, before anything is prepared; folders are made."""
    folder = next(each for each in out.resolve().parents if each.exists())
    if out.is_dir() or not folder.is_dir() or not os.access(folder, os.W_OK):
        reason = "it is a folder" if out.is_dir() else f"{folder} is no folder that can be written to"
        raise InputError(f"{out} cannot be written ({reason}); give another file with --out.")


def _case(settings: Any, config: Path, scene: str) -> Case:
    """Return the body of a scene under its disc, without any sample."""
    scenes = {
        f"{body}_{regime}": (body, regime) for body in pressed_bodies(settings) for regime in settings.regimes or {}
    }
    if not scenes:
        raise InputError(f"{config} presses no body under a disc; add tradeoff, as palpate init writes it.")
    if scene not in scenes:
        raise InputError(f"--scene {scene} is not in {config}; {suggest(scene, list(scenes), 'choose from')}")
    name, regime = scenes[scene]
    body = make_body(name, settings.bodies[name].seen_from(config.parent))
    radius_m, tolerance = settings.regimes[regime].radius_on(name), settings.solver.tolerance
    return Case.untrained(body, regime, radius_m, settings.seed, tolerance)
