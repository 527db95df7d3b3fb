"""An effect of one's own: wind that pushes on every piece of a surface, given as a pressure [Pa] along x."""

import numpy as np


def make(particles, settings, elastic):
    """Make the effect; ``settings`` are what the scene says of it."""
    return Wind(particles.areas, settings["pressure_pa"])


class Wind:
    """A constant load; ``outer`` says that its work comes from outside and is no stored energy."""

    outer = True

    def __init__(self, areas, pressure_pa):
        self._load = pressure_pa * np.outer(areas, [1.0, 0.0, 0.0])  # (n, 3) [N]

    def add_force(self, x, v, force):
        """Add the load to ``force`` (n, 3) [N], in place."""
        force += self._load
