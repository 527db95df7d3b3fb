"""Answer with shape matching as fitted: clusters of particles that a force presses until they settle."""

import numpy as np

from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, Setting, distinct
from palpate.models.memory import held_mb
from palpate.models.shape_statics import Shapes, cubes, fit

REDUCES, LAW = "p2", "shape matching"
"""They are fitted to its responses."""


def settings(case: Case) -> list[Setting]:
    """List mode, clusters and steps, from cheap to expensive."""
    tried = case.grid["shape_matching"]["combinations"]
    return distinct({key: each[key] for key in ("mode", "clusters", "steps")} for each in tried)


def prepare(case: Case, setting: Setting) -> "ShapesAtRest":
    """Fit the scale of forces and β to training samples after as many steps as will be taken.

    Raises InputError for a body that nothing holds, NotConverged if nothing fits.
    """
    grid, clusters = case.grid["shape_matching"], cubes(case.body.coarse) | {"kind": setting["clusters"]}
    shapes = Shapes(case, setting["mode"], clusters)
    shapes.soften(fit(shapes, case.use_training(), setting["steps"], grid["samples"], grid["evaluations"]))
    return ShapesAtRest(shapes, setting["steps"])


class ShapesAtRest:
    """Shapes that are given so many ``steps`` from rest to settle."""

    def __init__(self, shapes: Shapes, steps: int):
        self._shapes, self._steps = shapes, steps
        self.memory_mb = held_mb(self)

    def respond(self, load: Load) -> np.ndarray:
        """Return the displacement (n_surface, 3) [m] under ``load``; InputError for a bad contact."""
        return self._shapes.up @ self._shapes.settle(*load.single(), self._steps)
