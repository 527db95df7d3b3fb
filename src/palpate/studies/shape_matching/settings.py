"""Settings of paper 3's experiments."""

from pathlib import Path
from typing import Any

from palpate.errors import InputError, describe_unknown
from palpate.setting_types import Block, Count, NotNegative, Positive, Share, key


class IntegratorStability(Block):
    alphas: list[Share] = key("Stiffnesses of goal positions that are compared", [0.1, 0.5, 1.0], min_length=1)


class Clusters(Block):
    force_n: Positive = key("Sideways force on its top [N]", 0.15)
    alpha: Share = key("Stiffness, from 0 to 1", 0.5)
    beta: NotNegative = key("Deformation, from 0 to 1", 0.8, le=1)


class Creep(Block):
    scene: str = key("Name of a scene with springs and maxwell that a push loads")


class Timing(Block):
    repeats: Count = key("Turns over all rows", 5)


class BodySprings(Block):
    force_n: Positive = key("Force of the poke [N]", 0.2)
    stiffnesses_n_m: list[Positive] = key("Stiffnesses of virtual body springs [N/m]", [2, 10, 40], min_length=1)


class Settings(Block):
    """Paper 3's experiments."""

    integrator_stability: IntegratorStability = key("One spring, stepped by each integrator", {})
    clusters: Clusters = key("The column of 60 particles in 1, 2 and 5 clusters", {})
    creep: Creep | None = key("A scene whose creep is compared with the closed solution; null leaves it out", None)
    shape_matching_timing: Timing = key("What a step of shape matching costs", {})
    body_springs: BodySprings = key("A surface poked and released", {})


def check(config: Any, file: Path) -> None:
    """Raise InputError if the scene that creeps is unknown, or has no springs with Maxwell dampers under a load."""
    creep, scenes = config.shape_matching.creep, config.scenes or {}
    if creep is None:
        return
    if wrong := describe_unknown([creep.scene], list(scenes)):
        raise InputError(f"{file}: shape_matching.creep.scene names {wrong}")
    scene = scenes[creep.scene]
    if missing := [name for name in ("springs", "push", "maxwell") if getattr(scene, name) is None]:
        raise InputError(
            f"{file}: shape_matching.creep.scene names {creep.scene}, which lacks {', '.join(missing)}; name a "
            "scene of springs with maxwell that a push loads, or write creep: null."
        )
