"""What models of a cut body share: the question, the nodes that hooks move, and the skin that is looked at."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from scipy import sparse

from palpate.benchmark.cut_truth import Hook, Pulled, skin_map
from palpate.bodies.body import Body
from palpate.bodies.cutting.cut import Cut, unit
from palpate.bodies.cutting.ways import Parted, part
from palpate.errors import NotConverged
from palpate.models.fem_statics import to_fine


@dataclass(frozen=True, eq=False)
class CutCase:
    """What is asked: a body at rest is cut, and ``hooks`` pull.

    places : (k, 3) [m] of the skin where the opening is told, the motion of the positive side from the negative one's
    """

    body: Body
    cuts: Sequence[Cut]
    hooks: Sequence[Hook]
    places: np.ndarray

    @cached_property
    def place_rows(self) -> sparse.csr_array:
        """The linear interpolation (k, n_fine) to the places from all nodes of the finest level."""
        fine = self.body.fine
        return skin_map(fine, np.zeros(len(fine.triangles)), self.places, 1.0, degree=1)

    def sides(self, points: np.ndarray) -> np.ndarray:
        """Return on which side of each cut ``points`` (n, 3) [m] are, (n, cuts) 1 or -1."""
        return np.column_stack([np.where(cut.across(points) >= 0.0, 1, -1) for cut in self.cuts])


class CutModel(Protocol):
    """A model, prepared on the whole body."""

    def cut(self) -> None:
        """Follow the blade, up to what is ready to answer."""

    def pull(self) -> Pulled:
        """Answer what the hooks do; NotConverged where nothing is found."""


class Skin(NamedTuple):
    """The interpolation to what is looked at, from the nodes of a level, before it is cut.

    rows : (n_surface + 2k, n) to the fine surface, and to the places on the positive and on the negative side
    sides : (n_surface + 2k, cuts)
    """

    rows: sparse.csr_array
    sides: np.ndarray


def skin_of(case: CutCase, level: int) -> Skin:
    """Return the interpolation from a ``level`` of the body."""
    surface, to_all = case.body.fine.surface, to_fine(case.body, level)
    places = case.place_rows @ to_all
    ones = np.ones((len(case.places), len(case.cuts)), dtype=np.int64)
    rows = sparse.csr_array(sparse.vstack([to_all[surface], places, places]))
    return Skin(rows, np.vstack([case.sides(case.body.fine.nodes[surface]), ones, -ones]))


class Opened:
    """A parted level: who is held or moved, and how the skin follows.

    held : (n,) bool; moved : (n,) bool, on the hooks; shifts : (n, 3) [m] of these
    A piece that nothing holds or hooks, or by fewer than three nodes that are not in line, stays at rest.
    Raises NotConverged where no node lies on a hook.
    """

    def __init__(self, case: CutCase, level: int, skin: Skin, parted: Parted):
        self.case, self.parted, self.rest = case, parted, parted.mesh.nodes
        self._hooks, self.shifts = np.full(len(self.rest), -1), np.zeros_like(self.rest)
        for number, hook in enumerate(case.hooks):
            on = np.isin(parted.origin, hook.patch.nodes_of(parted.whole)) & parted.solid
            if not on.any():
                raise NotConverged(f"no node of level {level} lies on a hook; take a finer one", [float("nan")])
            self._hooks[on], self.shifts[on] = number, hook.shift_m
        self.moved, self.held = self._hooks >= 0, np.isin(np.arange(len(self.rest)), parted.body.anchors[0])
        self.held |= parted.loose(self.held | self.moved)
        self._skin = parted.interpolation(skin.rows, skin.sides)

    def answer(self, x: np.ndarray, force: np.ndarray) -> Pulled:
        """Return the answer at positions ``x`` (n, 3) [m], where the body has nodal forces ``force`` (n, 3) [N]."""
        seen, count = self._skin @ (x - self.rest), len(self.case.places)
        surface, positive, negative = np.split(seen, [len(seen) - 2 * count, len(seen) - count])
        forces = [
            -force[self._hooks == number].sum(axis=0) @ unit(hook.shift_m)
            for number, hook in enumerate(self.case.hooks)
        ]
        return Pulled(surface, positive - negative, np.array(forces))


def opened(case: CutCase, level: int, skin: Skin, way: str) -> Opened:
    """Cut a ``level`` of the body in a ``way``, see ``ways``."""
    return Opened(case, level, skin, part(case.body, level, case.cuts, way))
