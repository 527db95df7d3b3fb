"""Simulate bodies over time under effects that are objects: ``palpate.simulate``."""

import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from palpate.bodies.body import Body, Makes, as_body
from palpate.effects import settings
from palpate.errors import InputError
from palpate.scenes import scene_check
from palpate.scenes.effect_registry import EFFECTS, RESERVED
from palpate.scenes.motion import Motion
from palpate.scenes.moved_particles import particles_in
from palpate.scenes.own_effect import Maker
from palpate.scenes.run_scene import run, traits
from palpate.scenes.settings import Scene
from palpate.setting_types import Block

LISTED = {settings.Load: "push", settings.Hook: "hooks", settings.Thread: "threads"}
"""The block of a scene for effects of which there may be several."""


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
        returns an effect (docs/add-an-effect.md); tables call these by their class, as in wind, wind_2
    step_s, duration_s : of time [s]
    others : further bodies, each with its shift (3,) [m] from where it is defined
    scene : other fields of ``Scene``: integrator ("backward_euler"), level (0), held (True), frames (60), substeps ...

    Raises InputError for effects that do not suit each other, body or integrator, NotConverged for a step not found.
    """
    given: Any = effects
    if isinstance(given, Block | str) or not isinstance(given, Iterable):
        raise InputError(f"effects is {given!r}; give a list of effects, such as [Gravity()].")
    listed: Any = others
    pairs = list(listed) if isinstance(listed, Iterable) and not isinstance(listed, Block) else [listed]
    for i, pair in enumerate(pairs):
        if not isinstance(pair, tuple | list) or len(pair) != 2 or np.shape(pair[1]) != (3,):
            wanted = "a pair of a body and its shift (3,) [m], such as (box, (0, 0, 0.3))"
            raise InputError(f"others[{i}] is a {type(pair).__name__} and not {wanted}.")
    bodies = [as_body(each) for each in (body, *(other for other, _ in pairs))]
    blocks: dict[str, Any] = {}
    own_effects: dict[str, Maker] = {}
    for effect in effects:
        kind = type(effect).__name__
        name = _snake(kind)
        listed = next((block for kind, block in LISTED.items() if isinstance(effect, kind)), "")
        if listed:
            blocks.setdefault(listed, []).append(effect)
        elif not isinstance(effect, Block):
            if isinstance(effect, type) or not callable(getattr(effect, "make", None)):
                raise InputError(f"{effect!r} is no effect; give Gravity() or another one, or an object with make.")
            own_effects[_free(name, [*EFFECTS, *RESERVED, *scene.get("own", {}), *own_effects])] = effect
        elif name not in Scene.model_fields:
            raise InputError(f"{kind} is no effect; give Gravity, Load, Contact or another one.")
        elif name in blocks:
            raise InputError(f"there are two effects {kind}; give one.")
        else:
            blocks[name] = effect
    if "push" in blocks and not isinstance(blocks["push"], settings.Push):
        blocks["push"] = settings.Push(loads=blocks["push"])
    shifted = [{"body": made.name, "shift_m": list(shift)} for made, (_, shift) in zip(bodies[1:], pairs, strict=True)]
    times: dict[str, Any] = {"step_s": step_s, "duration_s": duration_s, "others": shifted}
    described = Scene(**times | {"body": bodies[0].name, "name": bodies[0].name} | blocks | scene)
    if described.step_s > described.duration_s:
        raise InputError(f"step_s is {step_s:g}, and duration_s {duration_s:g}; give a step that is not longer.")
    scene_check.check_instruments(described.place, described)
    scene_check.check_loads(described.place, described)
    particles = particles_in(described, bodies)
    scene_check.check_together(described.place, described, traits(particles))
    return run(described, particles, own=own_effects).motion


def _free(name: str, taken: Sequence[str]) -> str:
    """Return ``name``, with the first number from 2 on that makes it another than those that are ``taken``."""
    return next(each for each in (name, *(f"{name}_{i}" for i in range(2, len(taken) + 3))) if each not in taken)


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()
