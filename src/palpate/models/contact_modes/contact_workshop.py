"""Make the reduced models of contacts: elements, snapshots and limits of one body under discs of one radius.

All settings of a model share what they have in common, and are charged for it alike.
"""

from collections.abc import Callable
from functools import cached_property
from time import perf_counter
from typing import Any, TypeVar

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.refinement import finer, quadratic_prolongation
from palpate.effects.patch_load import Patch, patch_at, patch_shares
from palpate.models.fem_statics import to_surface, with_unknowns
from palpate.models.reduction.columns import linear_columns
from palpate.models.reduction.contact_snapshots import ContactSnapshots, columns_of_contact, press_contact
from palpate.models.reduction.elements_at_rest import ElementsAtRest
from palpate.models.reduction.nested_targets import Change, change_from_coarser, change_to_finer
from palpate.models.reduction.nested_targets import to_surface as brought
from palpate.models.reduction.training_presses import PRESSURE

NEAR = 1e-5
"""Relative residual of the responses that show a ratio."""
ORDER = 2
Made = TypeVar("Made")


def reduced_level(body: Body, most: int) -> int:
    """Return the finest level of ``body`` whose quadratic elements have at most ``most`` nodes, or the coarsest."""
    sizes = [len(mesh.nodes) + len(mesh.edges) for mesh in body.levels]
    return max((level for level, size in enumerate(sizes) if size <= most), default=0)


class Workshop:
    """Reduces quadratic elements on the ``reduced_level`` of ``body``.

    radius_m : of the disc that is pressed; 0 presses one node
    seconds : what each thing that was made has taken, by its name
    """

    def __init__(self, body: Body, radius_m: float, most: int):
        self._body, self._radius_m, self.level = body, radius_m, reduced_level(body, most)
        self._made: dict[Any, Any] = {}
        self.seconds: dict[Any, float] = {}

    @property
    def gap(self) -> int:
        """The number of levels between the one that is reduced and the body's finest."""
        return len(self._body.levels) - 1 - self.level

    @property
    def three_levels(self) -> range:
        """The levels that show a ratio: the last three, or the first three that the body has with finer ones."""
        last = max(len(self._body.levels) - 1, 2)
        return range(last - 2, last + 1)

    def make(self, name: Any, how: Callable[[], Made]) -> Made:
        """Return the thing called ``name``, made by ``how`` at its first use."""
        if name not in self._made:
            begin, before = perf_counter(), sum(self.seconds.values())
            self._made[name] = how()
            self.seconds[name] = perf_counter() - begin - (sum(self.seconds.values()) - before)
        return self._made[name]

    def elements(self, level: int) -> ElementsAtRest:
        """Return the quadratic elements of a level."""
        return self.make(
            ("elements", level), lambda: ElementsAtRest(with_unknowns(self._body, level, ORDER), level, ORDER)
        )

    def up(self, level: int) -> Any:
        """Return the interpolation (n_surface, n) from the nodes of the quadratic elements of a level."""
        return self.make(("up", level), lambda: to_surface(self._body, level, ORDER))

    def refine(self, level: int) -> Any:
        """Return the interpolation (n_finer, n) from the nodes of a level's quadratic elements to the next level's."""
        levels = self._body.levels
        return self.make(("refine", level), lambda: quadratic_prolongation(levels[level], levels[level + 1]))

    def disc(self, node: int, level: int) -> tuple[np.ndarray, np.ndarray]:
        """Return nodes (k,) and shares (k,) of the disc around fine surface ``node``."""
        return patch_shares(self._body.levels[level], self._patch(node), ORDER)

    def shown(self, node: int, modes: str) -> ContactSnapshots:
        """Return columns of the disc around ``node`` with answers: the elements' own if ``modes`` is "snapshots"."""
        columns = self.make(("columns", node), lambda: self._columns(node))
        return columns if modes == "columns" else self.make((modes, node), lambda: press_contact(columns))

    def columns_before(self, node: int) -> np.ndarray:
        """Return the linear columns (n_surface, 3, 3) [m/N] of the level before."""
        return brought(self.up(self.level - 1), self._linear_before(node))

    def from_coarser(self, node: int, modes: str) -> Change:
        """Return what the hardest answers of ``shown`` have changed since the level before."""
        return self.make(("from coarser " + modes, node), lambda: self._from_coarser(node, modes))

    def to_finer(self, node: int, share: float) -> Change:
        """Return what changes to the next level, under ``share`` of the hardest presses of a contact's snapshots."""
        return self.make(("to finer", node), lambda: self._to_finer(node, share))

    def reduced_columns(self, node: int) -> np.ndarray:
        """Return the linear columns (n_surface, 3, 3) [m/N] of the level that is reduced."""
        return brought(self.up(self.level), self.shown(node, "columns").linear)

    def pressed_once(self, node: int, level: int) -> np.ndarray:
        """Return the linear response (n_surface, 3) [m/N] of a level to a unit force into ``node``.

        The level may be finer than the body's; elements are not kept.
        """
        whole = finer(self._body, max(0, level + ORDER - len(self._body.levels)))
        elements, patch = ElementsAtRest(whole, level, ORDER), self._patch(node)
        load = elements.nodal(*patch_shares(whole.levels[level], patch, ORDER), -patch.normal)
        moved = elements.solve(load[:, :, None], NEAR)[:, :, 0]
        for each in range(level, len(self._body.levels) - 1):
            moved = quadratic_prolongation(whole.levels[each], whole.levels[each + 1]) @ moved
        return moved[self._body.fine.surface]

    def _patch(self, node: int) -> Patch:
        return patch_at(self._body, node, self._radius_m)

    @cached_property
    def pressable(self) -> set[int]:
        """The nodes of the fine surface that are not held."""
        return set(np.setdiff1d(self._body.fine.surface, self._body.anchors[-1]).tolist())

    def _columns(self, node: int) -> ContactSnapshots:
        elements, young = self.elements(self.level), self._body.material.young_pa
        radius = self._radius_m or 0.05 * elements.size
        newtons = PRESSURE * young * np.pi * radius**2 / 2.0
        return columns_of_contact(elements, *self.disc(node, self.level), self._patch(node).normal, newtons)

    def _linear_before(self, node: int) -> np.ndarray:
        coarse = self.elements(self.level - 1)
        disc = self.disc(node, self.level - 1)
        return self.make(("columns before", node), lambda: linear_columns(coarse, *disc))

    def _from_coarser(self, node: int, modes: str) -> Change:
        level, linear = self.level, self._linear_before(node)
        coarse, ups = self.elements(level - 1), (self.up(level), self.up(level - 1))
        return change_from_coarser(self.shown(node, modes), coarse, self.disc(node, level - 1), linear, ups)

    def _to_finer(self, node: int, share: float) -> Change:
        level, shown = self.level, self.shown(node, "snapshots")
        finer, ups = self.elements(level + 1), (self.up(level), self.up(level + 1))
        return change_to_finer(shown, share, finer, self.disc(node, level + 1), self.refine(level), ups)
