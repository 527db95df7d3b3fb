"""The bodies of a scene as particles."""

from collections.abc import Sequence
from pathlib import Path

from palpate.bodies.body_file import load
from palpate.bodies.particles import Particles, merge_particles, particles_of
from palpate.scenes.scene import Scene


def load_particles(scene: Scene, bodies: Sequence[Path | str]) -> Particles:
    """Load the particles of a scene from the files ``bodies``, its own body first.

    Raises InputError if the bodies cannot be joined.
    """
    parts = [particles_of(load(path), scene.level, scene.surface) for path in bodies]
    if not scene.others:
        return parts[0]
    return merge_particles(parts, [[0.0, 0.0, 0.0], *(other["shift_m"] for other in scene.others)], scene.place)
