"""Simulate bodies over time under effects that are objects: ``palpate.simulate``."""

import re
from collections.abc import Sequence
from typing import Any, Protocol

from palpate.bodies.body import Body
from palpate.effects import settings
from palpate.errors import InputError
from palpate.scenes import scene_check
from palpate.scenes.motion import Motion
from palpate.scenes.moved_particles import particles_in
from palpate.scenes.own_effect import Maker
from palpate.scenes.run_scene import run
from palpate.scenes.settings import Scene
from palpate.setting_types import Block

LISTED = {settings.Load: "push", settings.Hook: "hooks", settings.Thread: "threads"}
"""The block of a scene for effects of which there may be several."""


class Makes(Protocol):
    """Settings of a body."""

    def make(self) -> Body: ...


def simulate(
    body: Body | Makes,
    effects: Sequence[Block | Maker],
    *,
    step_s: float,
    duration_s: float,
    others: Sequence[tuple[Body | Makes, Sequence[float]]] = (),
    **scene: Any,
) -> Motion:
    """Move a body over time under exactly the ``effects`` that are given, and return its motion.

    body : or its settings; its anchors and its bed hold it. Finite elements of its law hold it together, unless the
        effects have Springs or ShapeMatching
    effects : Gravity, Load, Contact, Rayleigh ... and objects of your own with ``make(particles, elastic)``, which
        returns an effect (docs/add-an-effect.md)
    step_s, duration_s : of time [s]
    others : further bodies, each with its shift (3,) [m] from where it is defined
    scene : other fields of ``Scene``: integrator ("backward_euler"), level (0), held (True), frames (60), substeps ...

    Raises InputError for effects that do not suit each other, the body or the integrator, and NotConverged for a step
    that is not found.
    """
    bodies = [each if isinstance(each, Body) else each.make() for each in (body, *(other for other, _ in others))]
    blocks: dict[str, Any] = {}
    own: dict[str, Maker] = {}
    for effect in effects:
        name = _snake(type(effect).__name__)
        listed = next((block for kind, block in LISTED.items() if isinstance(effect, kind)), "")
        if listed:
            blocks.setdefault(listed, []).append(effect)
        elif not isinstance(effect, Block):
            own[name] = effect
        elif name not in Scene.model_fields:
            raise InputError(f"{type(effect).__name__} is no effect; give Gravity, Load, Contact or another one.")
        elif name in blocks:
            raise InputError(f"there are two effects {type(effect).__name__}; give one.")
        else:
            blocks[name] = effect
    if "push" in blocks and not isinstance(blocks["push"], settings.Push):
        blocks["push"] = settings.Push(loads=blocks["push"])
    moved = [{"body": made.name, "shift_m": list(shift)} for made, (_, shift) in zip(bodies[1:], others, strict=True)]
    given: dict[str, Any] = {"body": bodies[0].name, "name": bodies[0].name, "others": moved}
    asked = Scene(**given | {"step_s": step_s, "duration_s": duration_s} | blocks | scene)
    scene_check.check_instruments(asked.place, asked)
    scene_check.check_loads(asked.place, asked)
    return run(asked, particles_in(asked, bodies), own=own).motion


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()
