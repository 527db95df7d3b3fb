"""Shape matching as fitted: clusters of particles that a force presses until they settle."""

import numpy as np

from palpate.models.memory import held_mb
from palpate.models.model import Case, Setting, checked
from palpate.models.shape_statics import Shapes, cubes, fit

SETTINGS = (
    ("quadratic", "one", 30),
    ("quadratic", "one", 100),
    ("linear", "cubes", 100),
    ("linear", "cubes", 300),
    ("quadratic", "cubes", 300),
)


def settings(case: Case) -> list[Setting]:
    """Mode, clusters and steps, from cheap to dear."""
    return [dict(zip(("mode", "clusters", "steps"), setting, strict=True)) for setting in SETTINGS]


def prepare(case: Case, setting: Setting) -> "ShapesAtRest":
    """Fit the scale of forces and β to training samples after as many steps as will be taken.

    Raises InputError for a body that nothing holds, NotConverged if nothing fits.
    """
    clusters = cubes(case.body.coarse) | {"kind": setting["clusters"]}
    shapes = Shapes(case, setting["mode"], clusters)
    shapes.soften(fit(shapes, case.training, setting["steps"]))
    return ShapesAtRest(shapes, setting["steps"], case.n_surface)


class ShapesAtRest:
    """Shapes that are given so many ``steps`` from rest to settle."""

    def __init__(self, shapes: Shapes, steps: int, n_surface: int):
        self._shapes, self._steps, self._n_surface = shapes, steps, n_surface
        self.memory_mb = held_mb(self)

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Displacement (n_surface, 3) [m] under ``force`` (3,) [N]; NotConverged, InputError for a bad contact."""
        return checked(self._shapes.up @ self._shapes.settle(contact, force, self._steps), self._n_surface)
