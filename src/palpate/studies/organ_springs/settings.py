"""Settings of paper 2's chain for an organ."""

from pathlib import Path
from typing import Any

from palpate.errors import InputError, suggest
from palpate.setting_types import Block, Count, Positive, Some, Switch, Whole, key


class Searches(Block):
    seeds: Count = key("How often searches with random numbers are repeated", 3)
    population: Whole = key("Individuals of the genetic algorithm", 30, ge=4)
    generations: Count = key("Generations of the genetic algorithm", 60)
    cma_es_evaluations: Count = key("Sets of moduli that CMA-ES may try", 960)
    gradient_evaluations: Count = key("Gradients that the descent may compute", 40)


class Settings(Block):
    """Paper 2's chain for an organ: masses from its CT, springs fitted to some presses and tested at others."""

    bodies: Some[str] | None = key("Bodies whose springs are fitted; null for those from a CT", None)
    fitted: Count = key("Contacts whose presses springs are fitted to", 3)
    tested: Count = key("Other contacts at which they are tested", 5)
    rise_s: Positive = key("Time in which the force grows [s]", 0.2)
    duration_s: Positive = key("Simulated time [s]", 0.4)
    frames: Count = key("Equal parts of this time at whose ends motions are compared", 20)
    reference_steps: Count = key(
        "The reference's implicit steps in a frame; extrapolated from these and twice as many", 1
    )
    key_points: Count = key("Nodes of the coarse surface that fits look at", 24)
    volume_force: Some[Switch] = key("Whether springs have paper 2's volume force; a list tries both", [False])
    searches: Searches = key("How long searches go on", {})
    fem_frames: Some[Count] = key("Frames in an implicit step of the coarse finite elements beside springs", [4, 2, 1])
    shape_steps: Some[Count] = key("Steps in each frame of the shape matching that springs are compared with", [2])
    shape_evaluations: Count = key("Motions of each press that its fit may compute", 40)


def check(config: Any, file: Path) -> None:
    """Raise InputError for bodies that are not there or are sheets, none at all, and settings that do not fit."""
    place, settings = f"{file}: organ_springs", config.organ_springs
    possible = [name for name, body in config.bodies.items() if body.kind != "sheet"]
    chosen = settings.bodies or [name for name in possible if config.bodies[name].kind == "ct"]
    if not chosen:
        raise InputError(f"{place} is there and no body is of kind ct; name one in organ_springs.bodies, or remove it.")
    for name in chosen:
        if name not in possible:
            raise InputError(f"{place}.bodies names {name}, which is no solid body; {suggest(name, possible, 'name')}")
    if settings.rise_s > settings.duration_s:
        raise InputError(
            f"{place}.rise_s is {settings.rise_s:g} s, and motions end after duration_s, {settings.duration_s:g} s, "
            "before the force is there; lower rise_s, or give a longer duration_s."
        )
    for every in settings.fem_frames:
        if settings.frames % every:
            raise InputError(
                f"{place}.fem_frames has {every}, which does not divide frames, {settings.frames}; change one of them."
            )
