"""A scene: the simulation that an entry in the config describes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.bodies.body import Body
    from palpate.bodies.particles import Particles

RELAXED: dict[str, dict] = {
    "xpbd": {"iterations": 1},
    "projective_dynamics": {"iterations": 10, "memory": 0},
    "vertex_block_descent": {"sweeps": 10, "radius": 0.0},
}
"""What a step of a method that relaxes elements one by one has if the scene does not say."""
TOUCHING = {"vibrations": 10, "modes": 75, "states": 40, "thinning": 0.03, "tolerance": 6e-3}
"""The same of a motion in modes of strokes."""


@dataclass(frozen=True)
class Scene:
    """One entry of ``scenes:`` in the config, complete.

    others : further bodies, each with its ``body`` and the ``shift_m`` (3,) [m] to its place
    effects : their names, or "auto"
    substeps : the number of equal parts in which each step is taken; "auto" for as many as the integrator needs
    settings : name of an effect → its block or list; own : name of the user's own effect → its file
    """

    name: str
    effects: str | list[str]
    integrator: str
    step_s: float
    duration_s: float
    level: int = 0
    surface: bool = False
    held: bool = True
    start: str = "rest"
    frames: int = 60
    tolerance: float = 1e-8
    allow_unstable: bool = False
    substeps: int | str = 1
    seed: int = 1
    others: list[dict] = field(default_factory=list)
    settings: dict[str, Any] = field(default_factory=dict)
    own: dict[str, Path] = field(default_factory=dict)

    @property
    def steps(self) -> int:
        """The number of steps that cover the duration."""
        return max(1, math.ceil(self.duration_s / self.step_s - 1e-9))

    @property
    def integration(self) -> dict:
        """The settings of the integrator: its tolerance, how long it steps, and what a relaxed step and modes have."""
        usual = RELAXED | {"touching": TOUCHING}
        return {"tolerance": self.tolerance, "duration_s": self.duration_s} | {
            name: own | self.settings.get(name, {}) for name, own in usual.items()
        }

    @property
    def entry(self) -> dict:
        """What decides which effects act, as the config has it."""
        named = {"effects": self.effects, "held": self.held, "start": self.start, "others": self.others}
        return named | {"own": self.own} | self.settings

    @property
    def place(self) -> str:
        """The name in messages."""
        return f"scenes.{self.name}"


def scene_of(name: str, entry: dict, seed: int = 1) -> Scene:
    """Make the scene of a complete config entry, whose ``own`` holds paths that can be opened directly."""
    plain = {key: entry[key] for key in Scene.__dataclass_fields__ if key in entry and key not in ("settings", "own")}
    blocks: dict[str, Any] = {
        key: value for key, value in entry.items() if key not in plain and isinstance(value, dict | list)
    }
    own = {key: Path(value) for key, value in blocks.pop("own", {}).items()}
    extra = blocks.pop("own_settings", {})
    return Scene(name=name, seed=seed, settings=blocks | extra, own=own, **plain)


def bodies_in(entry: dict) -> list[str]:
    """Return the names of all bodies in a scene's entry, its own first."""
    return [entry["body"], *(other["body"] for other in entry.get("others", []))]


def load_particles(scene: Scene, bodies: Sequence[Path | str]) -> "Particles":
    """Load the particles of a scene from the files ``bodies``, its own body first; InputError as ``particles_in``."""
    from palpate.bodies.body_file import load

    return particles_in(scene, [load(path) for path in bodies])


def particles_in(scene: Scene, bodies: "Sequence[Body]") -> "Particles":
    """Make the particles of a scene of ``bodies``, its own first, which is the one that it cuts.

    Raises InputError if the bodies cannot be joined, and for a cut that severs nothing.
    """
    from palpate.bodies.particles import merge_particles, particles_of

    parts = [particles_of(body, scene.level, scene.surface) for body in bodies]
    if "cut" in scene.settings and (scene.effects == "auto" or "cut" in scene.effects):
        from palpate.bodies.cutting.ties import cut_particles

        parts[0] = cut_particles(scene.place, bodies[0], scene.level, scene.settings["cut"])
    if not scene.others:
        return parts[0]
    return merge_particles(parts, [[0.0, 0.0, 0.0], *(other["shift_m"] for other in scene.others)], scene.place)
