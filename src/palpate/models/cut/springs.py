"""Answer with springs on the edges of a level: those that the blade crosses are deleted, or nodes are doubled.

Springs have the moduli of the material (Van Gelder 1998), of each element as much as there is tissue in it. Forces are
multiplied by one factor, by which those on the hooks, before the cut, are those of quadratic elements.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from palpate.benchmark.cut_truth import TOLERANCE, Pulled, forces_on, pulled
from palpate.bodies.cutting.cut import Cut
from palpate.bodies.cutting.ways import Parted, whole
from palpate.bodies.particles import particles_of
from palpate.bodies.refinement import with_midpoints
from palpate.effects.springs import Springs
from palpate.errors import NotConverged
from palpate.linalg.block_pattern import hold, pattern_of, product
from palpate.linalg.minimiser import minimise_by_lbfgs
from palpate.linalg.multigrid import Factor
from palpate.models.cut.opened import CutCase, LevelModel, Opened
from palpate.models.springs.spring_motion import spring_model
from palpate.models.touch.springs import CALIBRATING_ITERATIONS
from palpate.solvers.grasping import Grasping, Patch

DELETED = "deleted"
LIFT = 1e-4
"""Stiffness added to every node of the preconditioner, over the mean: where springs are deleted, nodes hang loosely."""


@dataclass(frozen=True, eq=False)
class Torn(Parted):
    """A level whose nodes are as before, though springs between them are gone.

    Points of the skin follow those corners of their triangle that are on their own side of the ``cuts``.
    """

    cuts: Sequence[Cut]

    def interpolation(self, rows: sparse.csr_array, sides: np.ndarray) -> sparse.csr_array:
        rows = sparse.csr_array(rows)
        at, places = np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr)), rows @ self.whole.nodes
        own = np.ones(len(at), dtype=bool)
        for c, cut in enumerate(self.cuts):
            of_nodes = np.where(cut.across(self.whole.nodes) >= 0.0, 1, -1)
            own &= (of_nodes[rows.indices] == sides[at, c]) | (cut.within(places) <= 0.0)[at]
        own |= (np.bincount(at, own * rows.data, minlength=rows.shape[0]) <= 0.0)[at]
        sums = np.bincount(at, own * rows.data, minlength=rows.shape[0])
        return sparse.csr_array((own * rows.data / sums[at], rows.indices, rows.indptr), shape=rows.shape)


def before_cut(case: CutCase, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements (n, 3) [m] and forces [N] of hooks before the cut, by quadratic elements on a ``level``."""
    body, patch = with_midpoints(case.body, level), Patch(np.concatenate([hook.patch.corners for hook in case.hooks]))
    problem = Grasping(body, level, 2, patch)
    x, count = pulled(problem, case.hooks), len(case.body.levels[level].nodes)
    return (x - problem.mesh.nodes)[:count], forces_on(problem, case.hooks, x)


class CutSprings(LevelModel):
    """A network that makes so many quasi-Newton ``iterations`` from its linear answer."""

    def __init__(self, case: CutCase, level: int, way: str, iterations: int):
        super().__init__(case, level, way)
        self._iterations, self._factor = CALIBRATING_ITERATIONS, 1.0
        self._ready(self._looked_at(whole(case.body, level, 0)))
        before, right = self.pull().force, before_cut(case, level)[1]
        self._factor, self._iterations = float(before @ right / (before @ before)), iterations

    def cut(self, cuts: Sequence[Cut]) -> None:
        if self._way != DELETED:
            self._ready(self._part(cuts))
            return
        before = whole(self.case.body, self._level, len(cuts))
        self._ready(self._looked_at(Torn(**vars(before), cuts=cuts), cuts), deleted=cuts)

    def _ready(self, cut: Opened, deleted: Sequence[Cut] = ()) -> None:
        self._opened, rest = cut, cut.rest
        particles = particles_of(cut.parted.body, 0, surface=False)
        model = spring_model(particles)
        kept = np.ones(len(model.pairs), dtype=bool)
        for each in deleted:
            kept &= ~each.severs(*np.swapaxes(rest[model.pairs], 0, 1))
        stiffness = particles.material.young_pa * model.weights
        self._springs = Springs(model.pairs[kept], stiffness[kept], model.rest_m[kept])
        self._still = cut.held | cut.moved
        pattern = pattern_of(self._springs.couples, len(rest))
        values = np.zeros((len(pattern.indices), 3, 3))
        self._springs.add_stiffness(rest, True, pattern.slots[0], values)
        values[pattern.diagonal] += LIFT * np.trace(values[pattern.diagonal].mean(axis=0)) / 3.0 * np.eye(3)
        matrix = pattern.matrix(values)
        self._stiffness = product(matrix)
        bound = matrix.copy()
        hold(bound.indptr, bound.indices, bound.data, self._still)
        self._solve = Factor(bound).solve

    def pull(self) -> Pulled:
        cut, start = self._opened, self._linear()
        scale = TOLERANCE * float(np.linalg.norm(self._free_force(start)[cut.moved]))
        way = minimise_by_lbfgs(self, self._solve, start, scale, self._iterations)
        if not np.isfinite(way.x).all():
            raise NotConverged("springs left the finite numbers", way.forces)
        return cut.answer(way.x, self._factor * self._free_force(way.x))

    def _linear(self) -> np.ndarray:
        """Return the positions (n, 3) [m] of the network linearised at rest."""
        cut = self._opened
        left = -self._stiffness(cut.shifts)
        left[self._still] = 0.0
        return cut.rest + cut.shifts + self._solve(left)

    def energy(self, x: np.ndarray) -> float:
        return self._springs.energy(x)

    def force(self, x: np.ndarray) -> np.ndarray:
        force = self._free_force(x)
        force[self._still] = 0.0
        return force

    def _free_force(self, x: np.ndarray) -> np.ndarray:
        force = np.zeros_like(x)
        self._springs.add_force(x, None, force)
        return force
