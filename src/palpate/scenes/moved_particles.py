"""The particles of a scene: those of its bodies, joined, and prepared for its cut."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.scenes.settings import Scene

if TYPE_CHECKING:
    from palpate.bodies.body import Body
    from palpate.bodies.particles import Particles


def load_particles(scene: Scene, bodies: Sequence[Path | str]) -> "Particles":
    """Load the particles of a scene from the files ``bodies``, its own body first; InputError as ``particles_in``."""
    from palpate.bodies.body_file import load

    return particles_in(scene, [load(path) for path in bodies])


def particles_in(scene: Scene, bodies: "Sequence[Body]") -> "Particles":
    """Return the particles of a scene of ``bodies``, the first of which is the one that it may cut.

    Raises InputError if the bodies cannot be joined, and for a cut that severs nothing.
    """
    from palpate.bodies.particles import merge_particles, particles_of

    parts = [particles_of(body, scene.level, scene.surface) for body in bodies]
    if scene.cut is not None:
        from palpate.bodies.cutting.ties import cut_particles

        parts[0] = cut_particles(scene.place, bodies[0], scene.level, scene.cut)
    if not scene.others:
        return parts[0]
    return merge_particles(parts, [[0.0, 0.0, 0.0], *(other.shift_m for other in scene.others)], scene.place)
