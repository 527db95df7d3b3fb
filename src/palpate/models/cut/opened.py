"""What models of a cut body share: the question, the nodes that hooks move, and the skin where answers are read."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy import sparse

from palpate.benchmark.cut_truth import Hook, Pulled, forces_on, pulled, skin_map
from palpate.bodies.body import Body
from palpate.bodies.cutting.cut import Cut
from palpate.bodies.cutting.ways import VIRTUAL_NODES, Parted, part
from palpate.bodies.mesh import unit
from palpate.bodies.refinement import with_midpoints
from palpate.errors import NotConverged
from palpate.models.fem_statics import to_fine
from palpate.solvers.grasping import GraspedPatch, Grasping


@dataclass(frozen=True, eq=False)
class CutCase:
    """The question: a body at rest is cut, and ``hooks`` pull.

    places : (k, 3) [m] of the skin where the opening is read, the motion of the positive side less that of the negative
        one
    """

    body: Body
    cuts: Sequence[Cut]
    hooks: Sequence[Hook]
    places: np.ndarray

    @cached_property
    def seen(self) -> np.ndarray:
        """Where answers are read [m]: the fine surface, and the places of both lips, (n_surface + 2k, 3)."""
        return np.vstack([self.body.fine.nodes[self.body.fine.surface], self.places, self.places])

    def sides(self, cuts: Sequence[Cut]) -> np.ndarray:
        """Return on which side of each of ``cuts`` the places of ``seen`` lie, (n_surface + 2k, cuts), 1 or −1."""
        sides, count = np.ones((len(self.seen), len(cuts)), dtype=np.int64), len(self.places)
        for side, cut in zip(sides.T, cuts, strict=True):
            side[cut.across(self.seen) < 0.0] = -1
        sides[len(sides) - 2 * count :], sides[len(sides) - count :] = 1, -1
        return sides

    def parted(self, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the surface's displacement and the lips' opening, from displacements at the places of ``seen``."""
        count = len(self.places)
        surface, positive, negative = np.split(seen, [len(seen) - 2 * count, len(seen) - count])
        return surface, positive - negative

    @cached_property
    def place_rows(self) -> sparse.csr_array:
        """The linear interpolation (k, n_fine) to the places from all nodes of the finest level."""
        fine = self.body.fine
        return skin_map(fine, np.zeros(len(fine.triangles)), self.places, 1.0, degree=1)


class CutModel(Protocol):
    """A model, prepared on the whole body, which does not look at the ``cuts`` of its ``case`` before it is cut."""

    case: CutCase

    def cut(self, cuts: Sequence[Cut]) -> None:
        """Follow the blade, until ready to answer: the whole body has these ``cuts`` now, and none of earlier calls."""

    def pull(self) -> Pulled:
        """Return the answer to the hooks' motion; NotConverged where there is none."""


def skin_of(case: CutCase, level: int) -> sparse.csr_array:
    """Return the interpolation from the n nodes of a ``level`` to the places ``case.seen`` where answers are read."""
    to_all = to_fine(case.body, level)
    places = case.place_rows @ to_all
    return sparse.csr_array(sparse.vstack([to_all[case.body.fine.surface], places, places]))


class Opened:
    """A cut level: its held and moved nodes, and how the skin follows its nodes.

    held : (n,) bool; moved : (n,) bool, on the hooks; shifts : (n, 3) [m] of these
    A piece that nothing holds or hooks, or only fewer than three nodes that are not in line, stays at rest.
    NotConverged where no node lies on a hook.
    """

    def __init__(self, case: CutCase, level: int, skin: sparse.csr_array, parted: Parted, cuts: Sequence[Cut]):
        self.case, self.parted, self.rest = case, parted, parted.mesh.nodes
        self._hooks, self.shifts = np.full(len(self.rest), -1), np.zeros_like(self.rest)
        for number, hook in enumerate(case.hooks):
            hooked = np.isin(parted.origin, hook.patch.nodes_of(parted.whole)) & parted.solid
            if not hooked.any():
                raise NotConverged(f"no node of level {level} lies on a hook; take a finer one", [float("nan")])
            self._hooks[hooked], self.shifts[hooked] = number, hook.shift_m
        self.moved, self.held = self._hooks >= 0, np.isin(np.arange(len(self.rest)), parted.body.anchors[0])
        self.held |= parted.loose(self.held | self.moved)
        self._skin = parted.interpolation(skin, case.sides(cuts))

    def answer(self, x: np.ndarray, force: np.ndarray) -> Pulled:
        """Return the answer at positions ``x`` (n, 3) [m], where the body has nodal forces ``force`` (n, 3) [N]."""
        forces = [
            -force[self._hooks == number].sum(axis=0) @ unit(hook.shift_m)
            for number, hook in enumerate(self.case.hooks)
        ]
        return Pulled(*self.case.parted(self._skin @ (x - self.rest)), np.array(forces))


class LevelModel:
    """Base of models on one ``level`` of the body, which is cut in a ``way`` of ``bodies.cutting.ways``."""

    def __init__(self, case: CutCase, level: int, way: str = VIRTUAL_NODES):
        self.case, self._level, self._way, self._skin = case, level, way, skin_of(case, level)

    def _part(self, cuts: Sequence[Cut]) -> Opened:
        return self._looked_at(part(self.case.body, self._level, cuts, self._way), cuts)

    def _looked_at(self, parted: Parted, cuts: Sequence[Cut] = ()) -> Opened:
        return Opened(self.case, self._level, self._skin, parted, cuts)


def before_cut(case: CutCase, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements (n, 3) [m] of a level's n nodes and the hooks' forces [N] by quadratic elements, uncut."""
    body = with_midpoints(case.body, level)
    patch = GraspedPatch(np.concatenate([hook.patch.corners for hook in case.hooks]))
    problem = Grasping(body, level, 2, patch)
    x, count = pulled(problem, case.hooks), len(case.body.levels[level].nodes)
    return (x - problem.mesh.nodes)[:count], forces_on(problem, case.hooks, x)
