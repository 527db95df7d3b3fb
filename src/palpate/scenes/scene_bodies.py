"""Who plays in a scene: its body and the others, as particles."""

from collections.abc import Sequence
from pathlib import Path

from palpate.bodies.body_file import load
from palpate.bodies.particles import Particles, merge_particles, particles_of
from palpate.scenes.scene import Scene


def cast(scene: Scene, bodies: Sequence[Path | str]) -> Particles:
    """The particles of a scene whose bodies are in the files ``bodies``, its own first; InputError if they cannot be
    joined."""
    parts = [particles_of(load(path), scene.level, scene.surface) for path in bodies]
    if not scene.others:
        return parts[0]
    return merge_particles(parts, [[0.0, 0.0, 0.0], *(other["shift_m"] for other in scene.others)], scene.place)
