"""Reduce the reference's mesh to vibration and contact modes, made for the scene's own pushes or for others."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any

from palpate.models.reduced_body import ReducedBody
from palpate.scenes.build_system import compose
from palpate.scenes.scene import Scene
from palpate.studies.dynamic.dynamic_fit import Fitted
from palpate.studies.dynamic.dynamic_trial import Trial

TOLERANCE = 1e-4
"""Relative residual of a step; what the modes lack is more."""
OF_MODES = ("vibrations", "bent", "coarsened")
"""Settings that describe modes."""


def moving_modes(trial: Trial, lesson: Trial | None, grid: Mapping[str, Any]) -> Iterator[tuple[int, Fitted, str]]:
    """Yield steps in modes for the pushes of ``trial``, then, at the middle step, in modes for those of ``lesson``.

    Nothing is learnt: of the lesson's motion its places are taken alone, to see what a push elsewhere comes to.
    """
    modes = {key: grid[key] for key in OF_MODES}
    own = _prepared(trial, modes)
    for count in grid["steps_per_frame"]:
        yield count * trial.frames, own, ""
    here, there = (_places(each) if each else [] for each in (trial, lesson))
    if there and there != here:
        middle = grid["steps_per_frame"][len(grid["steps_per_frame"]) // 2]
        yield middle * trial.frames, _prepared(trial, modes | {"places": there}), "place=another"


def _places(trial: Trial) -> list[dict]:
    """List the discs that are pushed."""
    return [{key: load[key] for key in ("at_m", "radius_m")} for load in trial.loads.get("push", {}).get("loads", [])]


def _prepared(trial: Trial, modes: dict) -> Fitted:
    """Make the modes once, to see how long that takes."""
    begin, scene = perf_counter(), trial.reduced(trial.frames, modes)
    ReducedBody.of(compose(scene, trial.particles(-1)), scene.integration["reduced"])
    return Fitted(partial(_scene, modes), trial.body.material.young_pa, perf_counter() - begin, level=-1)


def _scene(modes: dict, trial: Trial, steps: int) -> Scene:
    return replace(trial.reduced(steps, modes), tolerance=TOLERANCE)
