"""Answer with linear responses: the whole body's compliance, updated by what a cut has severed, or prepared anew.

The compliance of all nodes is known before the cut; James and Pai (1999) keep that of the surface. A cut changes the
stiffness between few nodes, and new nodes are joined to these alone: they are eliminated at once. The forces of the
change and of the hooks then follow from one dense system of their nodes, the capacitance matrix.
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from palpate.benchmark.cut_truth import Pulled
from palpate.benchmark.load import Refused
from palpate.bodies.cutting.cut import Cut
from palpate.bodies.cutting.ways import REMOVAL, VIRTUAL_NODES
from palpate.bodies.material import Tissue
from palpate.bodies.mesh import TetMesh
from palpate.effects.linear_elements import LinearElements
from palpate.linalg.block_pattern import hold
from palpate.linalg.multigrid import Factor
from palpate.models.cut.elements import grasping
from palpate.models.cut.opened import CutCase, LevelModel
from palpate.models.fem_statics import coordinates_of, held_on
from palpate.solvers.grasping import SMALL

LARGEST = 3000
"""Nodes of a level up to which the compliance of all of them is kept, of 650 MB."""
TOGETHER = 64
"""Unit loads that are solved for at once."""


def online(case: CutCase, level: int, update: bool, way: str = VIRTUAL_NODES) -> "Anew | Updated":
    """Return linear responses of a ``level`` that is cut in a ``way``.

    update : whether the whole level's compliance is updated, and not the cut level's stiffness factorised; Refused
        where it would be too large, or nodes are lost
    """
    return (Updated if update else Anew)(case, level, way)


class Anew(LevelModel):
    """Linear elements on the cut level, with a factor of their own."""

    def cut(self, cuts: Sequence[Cut]) -> None:
        self._opened = self._part(cuts)
        self._problem = grasping(self._opened)

    def pull(self) -> Pulled:
        cut, problem = self._opened, self._problem
        largest = float(np.linalg.norm(cut.shifts, axis=1).max())
        response, scale = problem.response(cut.shifts[problem.grasped] / largest), SMALL * problem.mesh.size
        force = problem.free_force(cut.rest + scale * response) / scale
        return cut.answer(cut.rest + largest * response, largest * force)


class Updated(LevelModel):
    """The compliance (3n, 3n) [m/N] of the whole level, and what a cut adds to its stiffness."""

    def __init__(self, case: CutCase, level: int, way: str):
        super().__init__(case, level, way)
        mesh = case.body.levels[level]
        if way == REMOVAL:
            raise Refused("a compliance is not updated where nodes are lost")
        if (count := len(mesh.nodes)) > LARGEST:
            raise Refused(f"the compliance of {count} nodes takes {72e-9 * count**2:.1f} GB")
        self._held = held_on(case.body, level)
        matrix = LinearElements(mesh, case.body.tissue(level)).stiffness(mesh.nodes)
        hold(matrix.indptr, matrix.indices, matrix.data, self._held)
        factor, free = Factor(matrix), coordinates_of(np.flatnonzero(~self._held))
        self._compliance = np.zeros((3 * count, 3 * count))
        for part in np.array_split(free, max(1, len(free) // TOGETHER)):
            units = np.zeros((3 * count, len(part)))
            units[part, np.arange(len(part))] = 1.0
            self._compliance[:, part] = factor.solve(units.reshape(count, 3, -1)).reshape(3 * count, -1)

    def cut(self, cuts: Sequence[Cut]) -> None:
        """Eliminate new nodes from the change of stiffness; factorise the capacitance matrix of its nodes and hooks."""
        cut = self._opened = self._part(cuts)
        # elements that the cut has changed, and the stiffness of their nodes before and after it
        parted, count, prescribed = cut.parted, len(self._held), cut.held | cut.moved
        changed = (parted.origin[parted.mesh.tetrahedra] != parted.mesh.tetrahedra).any(axis=1)
        changed |= parted.body.tissue(0).share != 1.0
        changed = np.flatnonzero(changed | (np.bincount(parted.parents)[parted.parents] > 1))
        parents = np.unique(parted.parents[changed])
        affected = np.unique(np.append(parted.whole.tetrahedra[parents], parted.mesh.tetrahedra[changed]))
        stiffness_before = _stiffness(parted.whole, self.case.body.tissue(self._level), parents, affected)
        stiffness_after = _stiffness(parted.mesh, parted.body.tissue(0), changed, affected)
        # old nodes (o), new free nodes (f), which are eliminated, and new nodes that are held or moved (p)
        self._outer = affected[affected < count]
        self._outer = self._outer[~self._held[self._outer]]
        self._inner = affected[(affected >= count) & ~prescribed[affected]]
        self._kept = affected[(affected >= count) & prescribed[affected]]
        dofs = [coordinates_of(np.searchsorted(affected, nodes)) for nodes in (self._outer, self._inner, self._kept)]
        (oo, of, op), (fo, ff, fp), _ = self._new = [[stiffness_after[np.ix_(a, b)] for b in dofs] for a in dofs]
        self._outward = (  # minus the displacement of f nodes by those of o and p
            np.linalg.solve(ff, np.hstack([fo, fp])) if len(dofs[1]) else np.zeros((0, len(dofs[0]) + len(dofs[2])))
        )
        change = np.hstack([oo - stiffness_before[np.ix_(dofs[0], dofs[0])], op]) - of @ self._outward
        self._change, self._pull_of_kept = change[:, : len(dofs[0])], change[:, len(dofs[0]) :]
        # one system for the forces of the change on old nodes (o), and those on held or moved old nodes (h)
        self._driven = np.flatnonzero(prescribed[:count] & ~self._held)
        o, h = coordinates_of(self._outer), coordinates_of(self._driven)
        compliance = self._compliance[np.ix_(np.append(o, h), np.append(o, h))]
        capacitance = np.vstack([self._change @ compliance[: len(o)], compliance[len(o) :]])
        capacitance[: len(o), : len(o)] += np.eye(len(o))
        # forces and lengths in one system: rows of forces are of the order of 1, and so the others have to be
        self._scale = 1.0 / np.abs(compliance).max()
        capacitance[len(o) :] *= self._scale
        self._capacitance = lu_factor(capacitance)

    def pull(self) -> Pulled:
        """Solve for the forces of the change and the hooks, and sum the whole body's responses to them."""
        cut, count = self._opened, len(self._held)
        o, h = coordinates_of(self._outer), coordinates_of(self._driven)
        kept_shifts = cut.shifts[self._kept].ravel()
        right_side = np.append(-self._pull_of_kept @ kept_shifts, self._scale * cut.shifts[self._driven].ravel())
        forces = lu_solve(self._capacitance, right_side)
        moved, force = np.zeros_like(cut.rest), np.zeros_like(cut.rest)
        moved[:count] = (forces @ self._compliance[np.append(o, h)]).reshape(-1, 3)  # symmetric
        outer = moved[self._outer].ravel()
        inner = -self._outward @ np.append(outer, kept_shifts)
        moved[self._inner], moved[self._kept] = inner.reshape(-1, 3), cut.shifts[self._kept]
        force[self._driven] = -forces[len(o) :].reshape(-1, 3)
        po, pf, pp = self._new[2]
        force[self._kept] -= (po @ outer + pf @ inner + pp @ kept_shifts).reshape(-1, 3)
        return cut.answer(cut.rest + moved, force)


def _stiffness(mesh: TetMesh, tissue: Tissue, elements: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return the stiffness (3k, 3k) [N/m] of some ``elements`` at rest between ``nodes`` (k,), increasing."""
    share = None if tissue.share is None else tissue.share[elements]
    own = TetMesh(mesh.nodes[np.minimum(nodes, len(mesh.nodes) - 1)], np.searchsorted(nodes, mesh.tetrahedra[elements]))
    return LinearElements(own, Tissue(tissue.materials, tissue.region[elements], share)).stiffness(own.nodes).toarray()
