"""An effect of one's own: wind that pushes on every piece of a surface, a pressure [Pa] along x."""

import numpy as np


class Wind:
    """What a script or a scene says of the wind."""

    def __init__(self, pressure_pa):
        self.pressure_pa = pressure_pa

    def make(self, particles, elastic):
        """Return the effect on ``particles``; ``elastic`` is what holds them together."""
        return Load(self.pressure_pa * np.outer(particles.areas, [1.0, 0.0, 0.0]))


class Load:
    """Constant forces (n, 3) [N]; ``outer`` says that their work comes from outside and is no stored energy."""

    outer = True

    def __init__(self, forces):
        self._forces = forces

    def add_force(self, x, v, force):
        """Add the load to ``force`` (n, 3) [N], in place."""
        force += self._forces


def make(particles, settings, elastic):
    """Make the effect that a scene names; ``settings`` are what it says of it."""
    return Wind(**settings).make(particles, elastic)
