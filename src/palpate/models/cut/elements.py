"""Answer with finite elements on a cut level: removed, split along faces, doubled, or on a mesh that conforms.

All stop at the same residual, with the law of the body; settings differ in the mesh, by its level and by how it is cut.
A conforming mesh is that of the level, remeshed near the cut, with linear or quadratic elements.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.benchmark.cut_truth import TOLERANCE, CutMesh, Pulled, with_patches
from palpate.bodies.cutting.conform import cut_body
from palpate.bodies.cutting.cut import Cut, Cuts
from palpate.bodies.mesh import Mesh
from palpate.models.cut.opened import CutCase, LevelModel, Opened
from palpate.solvers.grasping import GraspedPatch, Grasping

CONFORM = "conform"


@dataclass(frozen=True, eq=False)
class Nodes(GraspedPatch):
    """What is grasped, as given ``nodes`` (k,) of one mesh, increasing."""

    nodes: np.ndarray

    def nodes_of(self, mesh: Mesh) -> np.ndarray:
        return self.nodes


class PartedElements(LevelModel):
    """Linear elements on a level that is cut in one of the ways."""

    def cut(self, cuts: Sequence[Cut]) -> None:
        self._opened = self._part(cuts)
        self.problem = grasping(self._opened)

    @property
    def lost_share(self) -> float:
        """Share of the volume that is lost with removed elements."""
        return self._opened.parted.lost_share

    def pull(self) -> Pulled:
        shifts = self._opened.shifts[self.problem.grasped]
        largest = float(np.linalg.norm(shifts, axis=1).max())
        (state,) = self.problem.push(shifts / largest, [largest], TOLERANCE)
        return self._opened.answer(state.x, self.problem.free_force(state.x))


def grasping(cut: Opened) -> Grasping:
    """Return the static problem of linear elements on a cut level whose hooks are moved by given shifts."""
    body = replace(cut.parted.body, anchors=[np.flatnonzero(cut.held & ~cut.moved)])
    return Grasping(body, 0, 1, Nodes(np.empty((0, 3, 3)), np.flatnonzero(cut.moved)))


class ConformingElements:
    """Quadratic elements on a level's mesh, remeshed to conform to the cut, with the finest triangles at hooks."""

    def __init__(self, case: CutCase, level: int):
        self.case, self._body = case, with_patches(case.body, case.hooks, level)
        mesh = case.body.levels[level]
        ends = mesh.nodes[mesh.edges]
        self._edge_m = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max())

    def cut(self, cuts: Sequence[Cut]) -> None:
        cut = cuts[0] if len(cuts) == 1 else Cuts(tuple(cuts))
        self._mesh = CutMesh(cut_body(self._body, cut, self._edge_m), self.case.hooks, 0, 0)

    def pull(self) -> Pulled:
        surface = self.case.body.fine.nodes[self.case.body.fine.surface]
        return self._mesh.answer(self._mesh.pull(), surface, self.case.places)


def online(case: CutCase, level: int, way: str) -> PartedElements | ConformingElements:
    """Return elements on a ``level`` that is cut in a ``way``, of which CONFORM remeshes it."""
    return ConformingElements(case, level) if way == CONFORM else PartedElements(case, level, way)
