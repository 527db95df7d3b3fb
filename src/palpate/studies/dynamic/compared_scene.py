"""A moving scene whose models are compared, and the scene that each model simulates in its place."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse

from palpate.benchmark.comparable import fits
from palpate.benchmark.moving_scene import MovingScene
from palpate.bodies.body import Body
from palpate.bodies.mesh import Sheet
from palpate.bodies.particles import Particles, merge_particles, particles_of
from palpate.effects.settings import (
    Bending,
    Gravity,
    Kelvin,
    Push,
    ShapeMatching,
    Springs,
    Touching,
    VelocityDamping,
    Volume,
)
from palpate.errors import InputError, NotConverged
from palpate.models.fem_statics import to_surface
from palpate.scenes import effect_registry
from palpate.scenes.run_scene import Run, compose, run
from palpate.scenes.settings import Scene
from palpate.setting_types import Block, key
from palpate.studies.dynamic.settings import Followed, Training


@dataclass(frozen=True, eq=False)
class ComparedScene(MovingScene):
    """A moving scene whose models are compared; each model simulates it by effects and an integrator of its own."""

    @property
    def thickness_m(self) -> float:
        """The thickness of a sheet, 0 of other bodies."""
        return self.body.coarse.thickness_m if isinstance(self.body.coarse, Sheet) else 0.0

    @property
    def order(self) -> int:
        """The order of the steps of finite elements: 2, but 1 where something is touched or yields."""
        return 1 if self.loads.contact or self.loads.plasticity else 2

    def scale_loads(self, factor: float) -> "ComparedScene":
        """Multiply gravity and pushes by ``factor``."""

        def scaled(vector: Sequence[float]) -> list[float]:
            return (factor * np.array(vector, dtype=float)).tolist()

        gravity, push = self.loads.gravity, self.loads.push
        if gravity:
            gravity = Gravity(acceleration_m_s2=scaled(gravity.acceleration_m_s2))
        if push:
            push = Push(loads=[each.but(force_n=scaled(each.force_n)) for each in push.loads])
        return replace(self, loads=self.loads.but(gravity=gravity, push=push))

    def widen(self, factor: float) -> "ComparedScene":
        """Multiply the gap at which contact begins to repel by ``factor``."""
        system = compose(self.fem(self.frames), self.particles(0))
        assert self.loads.contact is not None
        contact = self.loads.contact.but(gap_m=factor * vars(system.effects["contact"])["gap_m"])
        return replace(self, loads=self.loads.but(contact=contact))

    def fem(self, steps: int, order: int | None = None) -> Scene:
        """Return the scene of finite elements in implicit steps of ``order``, by default that of ``self.order``."""
        return self._elements("bdf2" if (order or self.order) == 2 else "backward_euler", steps)

    def relaxed(self, steps: int, method: str, setting: Mapping) -> Scene:
        """Return the scene of the same elements, relaxed one by one; ``setting`` is its block named ``method``."""
        return self._elements(method, steps, **{method: dict(setting)})

    def touching(self, steps: int, modes: Touching) -> Scene:
        """Return the scene of finite elements that move in modes of strokes."""
        return self._elements("touching", steps, touching=modes)

    def _elements(self, integrator: str, steps: int, **more: Any) -> Scene:
        bending = Bending() if self.thickness_m else None
        return self._scene(integrator, steps, bending=bending, rayleigh=self.rayleigh, **more)

    def springs(self, steps: int, stiffness: Springs, ratio: float, volume_n_m: float = 0.0) -> Scene:
        """Return the scene of springs in explicit steps, with dampers of ``ratio`` times critical damping.

        stiffness : a sheet's, empty for a solid, whose springs follow from its modulus
        """
        volume = Volume(stiffness_n_m=volume_n_m) if volume_n_m > 0.0 else None
        damped = {"kelvin": Kelvin(ratio=ratio), "velocity_damping": VelocityDamping(rate_1_s=self.rayleigh.mass_1_s)}
        return self._scene("symplectic_euler", steps, springs=stiffness, volume=volume, **damped)

    def shapes(self, steps: int, matching: ShapeMatching, rate_1_s: float) -> Scene:
        """Return the scene of shape matching, whose velocities decay at ``rate_1_s``."""
        decay = VelocityDamping(rate_1_s=rate_1_s)
        return self._scene("goal_position", steps, shape_matching=matching, velocity_damping=decay)

    def limit_s(self, scene: Scene, young_pa: float) -> float:
        """Return the longest step [s] in which the integrator of a ``scene`` is stable on the coarse level."""
        system = compose(scene, self.particles(0, young_pa))
        return effect_registry.integrator(scene.integrator).make(system, scene).limit_s

    def move(self, scene: Scene, level: int, young_pa: float | None = None) -> tuple[np.ndarray, Run]:
        """Run a ``scene`` on a level; return displacements (frames, n_surface, 3) [m] of the fine surface, and the run.

        young_pa : another modulus than the body's; NotConverged, InputError as ``run``
        """
        moved = run(scene, self.particles(level, young_pa))
        motion = moved.motion
        up = sparse.block_diag([to_surface(self.body, level)] * (1 + len(self.shifts_m)), format="csr")
        return np.array([up @ (x - motion.rest) for x in motion.positions[1:]]), moved

    def begin(self, scene: Scene, level: int, young_pa: float | None = None) -> None:
        """Make the first step of a scene, so that what it compiles or loads is no part of the time of ``move``."""
        with suppress(NotConverged):
            first = scene.model_copy(update={"duration_s": scene.step_s, "frames": 1})
            run(first, self.particles(level, young_pa))

    def nodes(self, level: int) -> int:
        """Return the number of nodes of all bodies."""
        return (1 + len(self.shifts_m)) * len(self.body.levels[level].nodes)

    def steps(self, step_s: float) -> int:
        """Return the least number of steps, none longer than ``step_s``, that end where frames do."""
        return self.frames * max(1, int(np.ceil(self.duration_s / (self.frames * step_s) - 1e-9)))

    def particles(self, level: int, young_pa: float | None = None) -> Particles:
        """Make the particles of a level of all bodies, with another modulus than the body's if one is given."""
        particles = particles_of(self.body, level, surface=False)
        if self.shifts_m:
            parts = [particles] * (1 + len(self.shifts_m))
            particles = merge_particles(parts, [[0.0, 0.0, 0.0], *self.shifts_m], f"scenes.{self.name}")
        if young_pa is None:
            return particles
        return replace(particles, material=replace(particles.material, young_pa=young_pa))

    def _scene(self, integrator: str, steps: int, **blocks: Any) -> Scene:
        if steps % self.frames:
            raise InputError(f"{self.name}: {steps} steps are no multiple of {self.frames} frames; change one of them.")
        named = {"name": self.name, "body": self.body.name, "held": self.held, "integrator": integrator}
        times = {"step_s": self.duration_s / steps, "duration_s": self.duration_s, "frames": self.frames}
        return Scene.model_validate(named | times | blocks | dict(self.placed_loads()))


class Compared(Block):
    """A scene that models are compared in, as a rule gives it to a job."""

    scene: Scene = key("The scene")
    own: Followed = key("How it is followed, and by which models")

    def of(self, body: Body) -> ComparedScene:
        """Make the compared scene of a body."""
        assert self.own.duration_s and self.own.frames  # as the rule says
        return ComparedScene.of(self.scene, body, self.own.duration_s, self.own.frames, self.own.level)

    def and_training(self, body: Body) -> tuple[ComparedScene, ComparedScene | None]:
        """Make the compared scene, and the motion that models are fitted to, if any is."""
        made = self.of(body)
        return made, training_of(made, self.own.training) if fits(self.own.models) else None


SHARE = 0.5
"""Of a scene's loads, that models are fitted to without another training."""


def training_of(compared: ComparedScene, training: Training | None, share: float = SHARE) -> ComparedScene:
    """Return the motion that models are fitted to: as ``training`` describes it, or under a share of the loads.

    training : its gravity, push and contact change keys of the scene's; its ``others`` move other bodies at the start,
        and ``duration_s`` replaces the duration, if they are given; None for all loads times ``share``
    Its frames are as long as those of ``compared``, since what is fitted may depend on the step.
    """
    if training is None:
        return compared.scale_loads(share)
    replacing = {name: getattr(training, name) for name in ("gravity", "push", "contact")}
    blocks = {
        name: getattr(compared.loads, name).but(**dict(block)) for name, block in replacing.items() if block is not None
    }
    loads = compared.loads.but(**blocks)
    shifts = compared.shifts_m if training.others is None else [other.shift_m for other in training.others]
    frame_s = compared.duration_s / compared.frames
    frames = max(1, round((training.duration_s or compared.duration_s) / frame_s))
    return replace(compared, loads=loads, shifts_m=shifts, duration_s=frames * frame_s, frames=frames)
