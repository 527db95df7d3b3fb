"""Turn a scene into a trial of models: what moves and what acts, apart from what holds it together."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.bodies.body import Body, nest
from palpate.bodies.particles import Particles, particles_of
from palpate.errors import InputError
from palpate.models.fem_statics import to_surface
from palpate.scenes import effect_registry
from palpate.scenes.build_system import compose
from palpate.scenes.dynamic_check import LOADS, check_trial
from palpate.scenes.run_scene import Run, run
from palpate.scenes.scene import Scene


@dataclass(frozen=True, eq=False)
class Trial:
    """A scene whose models are compared at the ends of ``frames`` equal parts of ``duration_s``.

    body : of nested levels, the last of which is the reference's
    loads : blocks of LOADS; rayleigh : what damps the reference
    """

    name: str
    body: Body
    loads: dict[str, dict]
    rayleigh: dict
    duration_s: float
    frames: int

    def scale_loads(self, factor: float) -> "Trial":
        """Multiply the loads by ``factor``."""
        return replace(self, loads=_times(self.loads, factor))

    def fem(self, steps: int) -> Scene:
        """Compose finite elements, stepped implicitly."""
        return self._scene(["corotational", "rayleigh"], "backward_euler", steps, {"rayleigh": self.rayleigh})

    def springs(self, steps: int, ratio: float, volume_n_m: float) -> Scene:
        """Compose springs of the body's modulus and dampers of ``ratio`` times critical damping, stepped explicitly."""
        settings = {"kelvin": {"ratio": ratio}, "velocity_damping": {"rate_1_s": self.rayleigh["mass_1_s"]}}
        if volume_n_m > 0.0:
            settings["volume"] = {"stiffness_n_m": volume_n_m}
        return self._scene(["springs", *settings], "symplectic_euler", steps, settings)

    def shapes(self, steps: int, matching: dict, rate_1_s: float) -> Scene:
        """Compose shape matching with the settings ``matching``; velocities decay at ``rate_1_s``."""
        settings = {"shape_matching": matching, "velocity_damping": {"rate_1_s": rate_1_s}}
        return self._scene([*settings], "goal_position", steps, settings)

    def limit_s(self, scene: Scene, young_pa: float) -> float:
        """Return the longest step at which its integrator is stable on the coarse level."""
        return (
            effect_registry.integrator(scene.integrator).make(compose(scene, self._particles(0, young_pa)), {}).limit_s
        )

    def move(self, scene: Scene, level: int, young_pa: float | None = None) -> tuple[np.ndarray, Run]:
        """Run a scene; return displacements (frames, n_surface, 3) [m] of the reference's surface, and the run.

        young_pa : another modulus than the body's; NotConverged, InputError as ``run``
        """
        moved = run(scene, self._particles(level, young_pa))
        motion = moved.motion
        up = to_surface(self.body, level)
        return np.array([up @ (x - motion.rest) for x in motion.positions[1:]]), moved

    def steps(self, step_s: float) -> int:
        """Return the least number of steps, none longer than ``step_s``, that end where frames do."""
        return self.frames * max(1, int(np.ceil(self.duration_s / (self.frames * step_s) - 1e-9)))

    def _particles(self, level: int, young_pa: float | None) -> Particles:
        particles = particles_of(self.body, level, surface=False)
        if young_pa is None:
            return particles
        return replace(particles, material=replace(particles.material, young_pa=young_pa))

    def _scene(self, effects: list[str], integrator: str, steps: int, settings: dict) -> Scene:
        if steps % self.frames:
            raise InputError(f"{self.name}: {steps} steps are no multiple of {self.frames} frames; change one of them.")
        return Scene(
            self.name,
            [*effects, "held", *self.loads],
            integrator,
            step_s=self.duration_s / steps,
            duration_s=self.duration_s,
            frames=self.frames,
            settings=settings | self.loads,
        )


def trial(name: str, entry: dict, body: Body, duration_s: float, frames: int) -> Trial:
    """Make the trial of the scene ``entry`` of the config; one level finer than the scene if that is the coarse one.

    Raises InputError for a scene with contact, or whose loads are none of LOADS.
    """
    check_trial("dynamic.durations_s", name, entry)
    loads = {effect: entry[effect] for effect in LOADS if effect in entry}
    damping = entry.get("rayleigh", dict(effect_registry.EFFECTS["rayleigh"].settings or {}))
    return Trial(name, _nested(body, entry.get("level", 0)), loads, damping, duration_s, frames)


def _nested(body: Body, level: int) -> Body:
    last = max(level, 1)
    if len(body.levels) > last:
        parts = body.levels[: last + 1], body.prolongations[:last], body.anchors[: last + 1]
        return Body(body.name, *parts, body.material, body.bed, body.regions)
    return nest(body.name, body.coarse, 1, body.anchors[0], body.material, bed=body.bed, regions=body.regions)


def _times(loads: dict, factor: float) -> dict:
    found = {}
    if "gravity" in loads:
        g = np.array(loads["gravity"]["acceleration_m_s2"], dtype=float)
        found["gravity"] = {"acceleration_m_s2": (factor * g).tolist()}
    if "push" in loads:
        pushes = loads["push"]["loads"]
        forces = [(factor * np.array(push["force_n"], dtype=float)).tolist() for push in pushes]
        found["push"] = {"loads": [push | {"force_n": f} for push, f in zip(pushes, forces, strict=True)]}
    return found
