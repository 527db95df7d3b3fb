"""Answer a touch with shape matching: clusters of particles that the instrument pushes out of itself in every step.

The force is the momentum that this gives to the particles, over the time of a step, as a mean over the later
half of the steps. How far goals follow the particles
is fitted to the displacement under calibrating touches, and the time of a step to their forces.
"""

from typing import Literal

import numpy as np

from palpate.benchmark.model import Setting, on_own_levels, refuse_bed, refuse_regions
from palpate.benchmark.touch import TouchCase, Touched
from palpate.bodies.particles import particles_of
from palpate.effects import shape_matching
from palpate.effects.instrument import Pose
from palpate.effects.settings import ShapeMatching
from palpate.errors import InputError, NotConverged
from palpate.models.shape_matching import ALPHAS, LEFT, cubes
from palpate.models.touch.pushing import NodeTouch, Relaxing, calibration, force_scale
from palpate.solvers.xpbd import Obstacle

LAW = "shape matching"
BETAS = (0.0, 0.3, 0.6, 0.8, 0.95)
"""Shares of the deformation in the goals that are tried."""


def settings(case: TouchCase) -> list[Setting]:
    """List level, mode, clusters and steps, from cheap to expensive."""
    return on_own_levels(case, case.grid.shape_matching)


class ShapesTouch(NodeTouch):
    """Shapes that are given so many ``steps`` to settle wherever the instrument stops on its way.

    InputError for a body that nothing holds, or that its clusters do not hold together; LeftOut for one on a bed;
    NotConverged for one of several stiffnesses, or whose calibrating touches are not felt.
    """

    def __init__(
        self, case: TouchCase, level: int, mode: Literal["rigid", "linear", "quadratic"], clusters: str, steps: int
    ):
        refuse_bed(case, "shapes")
        refuse_regions(case, "shapes")
        super().__init__(case, level)
        self._steps = steps
        particles = particles_of(case.body, level, surface=False)
        if not len(particles.held):
            raise InputError(f"{case.body.name}: nothing is held, so shapes do not come to rest; give it anchors.")
        self._masses, self._step_s = particles.masses, 1.0
        grouped = cubes(self.mesh).but(kind=clusters)
        touches, right = zip(*calibration(case), strict=True)
        tried = []
        for alpha in ALPHAS:
            for beta in BETAS:
                words = ShapeMatching(mode=mode, alpha=alpha, beta=beta, clusters=grouped)
                self._matching = shape_matching.make(particles, words)
                found = [self.respond(touch) for touch in touches]
                off = [_rmse(one, other) for one, other in zip(found, right, strict=True)]
                tried.append((float(np.mean(off)), self._matching, found))
        least, self._matching, found = min(tried, key=lambda each: each[0])
        if not np.isfinite(least):
            raise NotConverged(f"{case.body.name}: shapes do not come to rest under any touch", [float("nan")])
        # a force goes as the inverse of the square of the step
        self._step_s = 1.0 / np.sqrt(force_scale(found, right))

    def begin(self, nodes: np.ndarray, pose: Pose) -> Relaxing:
        obstacle, inverse = Obstacle(nodes, pose), np.where(self.held, 0.0, 1.0 / self._masses)
        keep, alpha = LEFT ** (2.0 / self._steps), self._matching.alpha

        given = np.zeros((len(nodes), 3))

        def relax(x: np.ndarray) -> np.ndarray:
            w, goals = np.zeros_like(x), np.empty_like(x)  # in lengths a step
            given[:] = 0.0
            for step in range(self._steps):
                self._matching.goals(x, goals)
                w = keep * w + alpha * (goals - x)
                w[self.held] = 0.0
                moved = x + w
                obstacle.multipliers = np.zeros(len(nodes))
                obstacle.keep_out(moved, inverse)
                w, x = moved - x, moved
                if step >= self._steps // 2:  # particles bounce, so that single steps tell little
                    given[:] += obstacle.pushes(x, self._step_s) / (self._steps - self._steps // 2)
            return x

        return Relaxing(obstacle, relax, lambda x: given)

    def supported(self, x: np.ndarray) -> np.ndarray:
        goals = np.empty_like(x)
        self._matching.goals(x, goals)
        pulls = self._matching.alpha / self._step_s**2 * self._masses[:, None] * (goals - x)
        return pulls[self.held].sum(axis=0)


def _rmse(one: Touched, other: Touched) -> float:
    """Return the RMSE over the peak of the displacement, infinite if it is not a number."""
    off = np.sqrt(np.mean(np.sum((one.displacement - other.displacement) ** 2, axis=1)))
    peak = np.linalg.norm(other.displacement, axis=1).max()
    return float(off / peak) if np.isfinite(off) else np.inf


online = ShapesTouch
