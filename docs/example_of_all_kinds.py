"""A model of your own that answers presses, touches and motions: an elastic half-space, which knows no other bounds."""

from dataclasses import dataclass

import numpy as np

from palpate.benchmark.touch import Touched
from palpate.effects.push import factor


@dataclass(frozen=True)
class HalfSpace:
    """Answer as a half-space of the body's material does, by Boussinesq and Hertz, at rest at every moment."""

    law = "linear"

    def prepare(self, case):
        """Prepare for any kind of question; no sample is asked for, so that none is missed."""
        return Surface(case.body, case.radius_m)


class Surface:
    """What answers, for the fine surface nodes."""

    def __init__(self, body, radius_m):
        self.places, self.nodes = body.fine.nodes[body.fine.surface], body.fine.nodes
        self.modulus = body.material.young_pa / (1.0 - body.material.poisson**2)
        self.radius_m = radius_m

    def pushed(self, place, force, radius_m):
        """Return the displacement (n_surface, 3) [m] under a force (3,) [N] on a disc, by its mean decay F/(π E* r)."""
        away = np.hypot(np.linalg.norm(self.places - place, axis=1), 0.375 * max(radius_m, 1e-3))
        return np.outer(1.0 / (np.pi * self.modulus * away), force)

    def respond(self, load):
        """Return the displacement (n_surface, 3) [m] under the forces of ``load``."""
        return sum(self.pushed(self.nodes[node], force, self.radius_m) for node, force in load.forces())

    def touch(self, touch):
        """Return displacement, force [N] and area [m²] of a ball of the instrument's radius at the depth asked."""
        area = np.pi * touch.instrument.radius_m * touch.depth_m
        force = 4.0 / 3.0 * self.modulus * np.sqrt(touch.instrument.radius_m * touch.depth_m) * touch.depth_m
        moved = self.pushed(self.nodes[touch.node], force * touch.direction, np.sqrt(area / np.pi))
        return Touched(moved, force, area)

    def move(self, motion):
        """Yield the displacement (n_surface, 3) [m] at the end of each frame, under the pushes of that time."""
        pushes = motion.placed_loads().pushes
        for end in motion.duration_s * np.arange(1, motion.frames + 1) / motion.frames:
            moved = np.zeros_like(self.places)
            for push in pushes:
                moved += self.pushed(push.at_m, factor(push, end) * np.array(push.force_n), push.radius_m)
            yield moved
