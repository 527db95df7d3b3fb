"""Make what reduced models of contacts are made of, for one body under discs of one radius: settings share it.

Beside elements and snapshots these are the target, which is the fine operator's answer or the limit of ever finer
levels, and how hard a contact bears to be pressed. Errors of nested levels fall by one ratio with each (Richardson
1911): the linear part of an answer is extrapolated by the columns of all levels there are; what is beyond it, by the
two levels that a contact's snapshots are pressed on. A thin lobe may fold or snap, on fine elements at smaller forces
than on coarse ones, which what is reduced from these does not see.
"""

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy import sparse

from palpate.benchmark.model import Case
from palpate.bodies.body import Body
from palpate.bodies.contacts import kept_contacts
from palpate.bodies.refinement import finer, quadratic_prolongation
from palpate.effects.patch_load import Patch, patch_at, patch_shares
from palpate.models import kinds
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.contact_modes.snapshots import (
    CORNERS,
    FORCE_FACTOR,
    PRESSURE,
    SHARES,
    SNAPSHOT_RESIDUAL,
    ContactSnapshots,
    columns_of_contact,
    likeness,
    linear_columns,
    press_contact,
)
from palpate.models.fem_statics import to_surface, with_unknowns

LEVEL_STEPS, COARSER_RESIDUAL = 20, 1e-3
"""Steps of L-BFGS on the coarser level, which is cheap, and the residual that ends them."""
FINER_RESIDUAL = 0.01
"""The residual over the load that ends the search on the finer level."""
SMOOTH = 0.005
"""Weight of the fit's penalty, over the largest singular value of what it is fitted to."""


class Change(NamedTuple):
    """Keep what s answers to presses of a contact change from one level to the next.

    forces : (s, 3) [N]; answers : (n, 3, s) [m], on the level that is reduced; change : (n_surface, 3, s) [m]
    """

    forces: np.ndarray
    answers: np.ndarray
    change: np.ndarray


def bring_to_surface(up: sparse.csr_array, moved: np.ndarray) -> np.ndarray:
    """Return (n_surface, 3, k) of displacements ``moved`` (n, 3, k) by the interpolation ``up`` (n_surface, n)."""
    return (up @ moved.reshape(len(moved), -1)).reshape(-1, *moved.shape[1:])


def fitted(seen: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Fit the matrix (n, 3, r) whose products with ``seen`` (r, s) are ``wanted`` (n, 3, s), by penalised squares.

    Each of the s pairs counts over its size, so that weak presses are met as well as hard ones.
    """
    norms = np.linalg.norm(seen, axis=0)
    weights = np.divide(1.0, norms, out=np.zeros_like(norms), where=norms > 0.0)
    left, sizes, right = np.linalg.svd(seen * weights, full_matrices=False)
    damped = sizes / (sizes**2 + (SMOOTH * sizes[0]) ** 2)
    return (((wanted * weights) @ right.T) * damped) @ left.T


RATIO_RESIDUAL = 1e-5
"""Relative residual of the responses that show a ratio."""
ORDER = 2
Made = TypeVar("Made")


def reduced_level(body: Body, most: int) -> int:
    """Return the finest level of ``body`` whose quadratic elements have at most ``most`` nodes, or the coarsest."""
    sizes = [len(mesh.nodes) + len(mesh.edges) for mesh in body.levels]
    return max((level for level, size in enumerate(sizes) if size <= most), default=0)


class Workshop:
    """Reduces quadratic elements on one ``level`` of ``body``.

    radius_m : of the disc that is pressed; 0 presses one node
    gap : number of levels between the one that is reduced and the body's finest
    pressable : the nodes of the fine surface that are not held
    seconds : what each thing that was made has taken, by its name
    """

    def __init__(self, body: Body, radius_m: float, level: int):
        self._body, self._radius_m, self.level = body, radius_m, level
        self.gap = len(body.levels) - 1 - level
        self.pressable = set(np.setdiff1d(body.fine.surface, body.anchors[-1]).tolist())
        self._made: dict[Any, Any] = {}
        self.seconds: dict[Any, float] = {}

    def make(self, name: Any, how: Callable[[], Made]) -> Made:
        """Return the thing called ``name``, made by ``how`` at its first use."""
        if name not in self._made:
            begin, before = perf_counter(), sum(self.seconds.values())
            self._made[name] = how()
            self.seconds[name] = perf_counter() - begin - (sum(self.seconds.values()) - before)
        return self._made[name]

    def elements(self, level: int) -> ElementsAtRest:
        """Return the quadratic elements of a level."""
        return self.make(("elements", level), lambda: ElementsAtRest(with_unknowns(self._body, level, ORDER), level))

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

    def linear(self, node: int, before: int = 0) -> np.ndarray:
        """Return the linear columns (n, 3, 3) [m/N] at all nodes of the elements that are reduced, or those before."""
        level = self.level - before
        elements, disc = self.elements(level), self.disc(node, level)
        return self.make(("columns before" if before else "linear", node), lambda: linear_columns(elements, *disc))

    def reduced_columns(self, node: int, before: int = 0) -> np.ndarray:
        """Return the same at the fine surface, (n_surface, 3, 3) [m/N]."""
        return bring_to_surface(self.up(self.level - before), self.linear(node, before))

    def pressed_once(self, node: int, level: int) -> np.ndarray:
        """Return the linear response (n_surface, 3) [m/N] of a level to a unit force into ``node``.

        The level may be finer than the body's; elements are not kept.
        """
        whole = finer(self._body, max(0, level + ORDER - len(self._body.levels)))
        elements, patch = ElementsAtRest(whole, level), self._patch(node)
        load = elements.nodal(*patch_shares(whole.levels[level], patch, ORDER), -patch.normal)
        moved = elements.solve(load[:, :, None], RATIO_RESIDUAL)[:, :, 0]
        for each in range(level, len(self._body.levels) - 1):
            moved = quadratic_prolongation(whole.levels[each], whole.levels[each + 1]) @ moved
        return moved[self._body.fine.surface]

    def _patch(self, node: int) -> Patch:
        return patch_at(self._body, node, self._radius_m)

    def _columns(self, node: int) -> ContactSnapshots:
        elements, young = self.elements(self.level), self._body.material.young_pa
        radius = self._radius_m or 0.05 * elements.size
        newtons = PRESSURE * young * np.pi * radius**2 / 2.0
        disc, normal = self.disc(node, self.level), self._patch(node).normal
        return columns_of_contact(elements, *disc, normal, newtons, self.linear(node))


def _from_coarser(shop: Workshop, node: int, modes: str) -> Change:
    """Press as hard as ``shop.shown`` does on the level before, and return the change to the answers there."""
    shown, level, linear = shop.shown(node, modes), shop.level, shop.linear(node, 1)
    coarse, disc = shop.elements(level - 1), shop.disc(node, level - 1)
    if shown.found:
        hardest = slice(None, len(shown.forces) // len(SHARES))
        forces, answers = shown.forces[hardest], shown.answers[:, :, hardest]
    else:  # a model of the columns is farther off than a level changes
        forces = shown.forces[list(CORNERS)]
        answers = np.stack([_settled(shown, k) for k in CORNERS], axis=2)
    count = len(coarse.rest)
    starts = answers[:count] + (linear - shown.linear[:count]) @ forces.T
    moved = [
        coarse.settle(coarse.nodal(*disc, force), np.ascontiguousarray(starts[:, :, s]), LEVEL_STEPS, COARSER_RESIDUAL)
        for s, force in enumerate(forces)
    ]
    before = bring_to_surface(shop.up(level - 1), np.stack(moved, axis=2))
    return Change(forces, answers, bring_to_surface(shop.up(level), answers) - before)


def _settled(shown: ContactSnapshots, k: int) -> np.ndarray:
    """Return the elements' answer (n, 3) [m] to the k-th press of ``shown``, from that of the model."""
    load = shown.elements.nodal(shown.nodes, shown.shares, shown.forces[k])
    return shown.elements.settle(load, np.ascontiguousarray(shown.answers[:, :, k]), LEVEL_STEPS, SNAPSHOT_RESIDUAL)


def _to_finer(shop: Workshop, node: int, share: float) -> Change:
    """Press on the next level, by ``share`` of the hardest straight and most tilted presses of the snapshots.

    What has changed at one press tells where the search of the next begins. A press that is not found, or that inverts
    an element, is left out.
    """
    level, shown = shop.level, shop.shown(node, "snapshots")
    elements, finer = shown.elements, shop.elements(level + 1)
    disc, refine, up = shop.disc(node, level + 1), shop.refine(level), shop.up(level)
    forces: list[np.ndarray] = []
    answers: list[np.ndarray] = []
    changes: list[np.ndarray] = []
    for k in CORNERS:
        force, moved = share * shown.forces[k], shown.answers[:, :, k]
        if share < 0.99:  # rounding aside
            load = elements.nodal(shown.nodes, shown.shares, force)
            moved = elements.settle(load, shown.modelled(force), LEVEL_STEPS, FINER_RESIDUAL)
        start, load = refine @ moved, finer.nodal(*disc, force)
        if forces:
            start = start + np.tensordot(likeness(np.array(forces), force, 1), np.array(changes), 1)
        found = finer.settle(load, start, LEVEL_STEPS, FINER_RESIDUAL)
        if finer.residual(found, load) <= FINER_RESIDUAL and finer.least_det(found) > 0.0:
            forces.append(force)
            answers.append(moved)
            changes.append(found - refine @ moved)
    if not forces:
        return Change(np.empty((0, 3)), shown.answers[:, :, :0], np.empty((up.shape[0], 3, 0)))
    before = np.stack(answers, axis=2)
    after = np.stack([refine @ each for each in answers], axis=2) + np.stack(changes, axis=2)
    change = bring_to_surface(shop.up(level + 1), after) - bring_to_surface(up, before)
    return Change(np.array(forces), before, change)


SOUND, TRIAL_RESIDUAL = 0.2, 0.05
"""Smallest det F of a sound answer, and the residual over the load at which it counts as found."""
SURE, HOPELESS = 0.7, 0.5
"""Smallest det F on the level that is reduced, from which on the next one need not be tried, and below which it is not
worth it. Of 49 straight presses of the liver with two discs none with 0.7 or more was unsound on the finer level, at
worst slow, and none with less than 0.5 was sound there."""
TRIAL_STEPS, TRIAL_FALLS = 16, 8
"""Most steps of L-BFGS of a trial, of which 8 are usual, and how often a press that has no answer is lowered."""


def bearing(shop: Workshop, nodes: Sequence[int], modes: str) -> np.ndarray:
    """Return (k, 3) [1/N], the inward normals at ``nodes`` over the largest inward forces known to have an answer.

    A force of which the product with its row is above 1 goes beyond them.
    """

    def most(node: int) -> float:
        return shop.make((f"{modes} bear", node), lambda: _bears(shop, node, modes))

    return np.array([-shop.shown(node, modes).normal / most(node) for node in nodes])


def _bears(shop: Workshop, node: int, modes: str) -> float:
    """Return the force [N] of the hardest straight press of a contact, or of the hardest that is sound, if less."""
    shown, level = shop.shown(node, modes), shop.level
    newtons = float(np.linalg.norm(shown.forces[0]))
    if shop.gap == 0:
        return newtons
    start = shown.answers[:, :, 0]
    for _ in range(TRIAL_FALLS):
        force = -newtons * shown.normal
        moved, least = _tried(shop, node, level, start, force)
        if least >= SURE:
            break
        if least >= HOPELESS and _tried(shop, node, level + 1, shop.refine(level) @ moved, force)[1] >= SOUND:
            break
        newtons *= FORCE_FACTOR
        start = shown.modelled(-newtons * shown.normal)
    return newtons


def _tried(shop: Workshop, node: int, level: int, start: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the displacement (n, 3) [m] of a level under ``force`` (3,) [N], and its smallest det F; -inf if none."""
    elements = shop.elements(level)
    load = elements.nodal(*shop.disc(node, level), force)
    moved = elements.settle(load, start, TRIAL_STEPS, TRIAL_RESIDUAL)
    return moved, elements.least_det(moved) if elements.residual(moved, load) <= TRIAL_RESIDUAL else -np.inf


LEAST_RATIO = 1.5
"""Smallest ratio that is extrapolated by; below, levels hardly approach a limit."""


def target_columns(shop: Workshop, case: Case, target: str, node: int) -> np.ndarray:
    """Return the linear responses (n_surface, 3, 3) [m/N] of ``target`` to unit forces at ``node``."""
    gap, reduced = shop.gap, shop.reduced_columns(node)
    fine = _fine_columns(shop, case, node)
    if target == "operator":
        return fine
    if gap:
        return fine + (fine - reduced) / (target_ratio(shop, case, node) ** gap - 1.0)
    return fine + (fine - shop.reduced_columns(node, 1)) / (target_ratio(shop, case, node) - 1.0)


def target_change(shop: Workshop, case: Case, model: kinds.ContactModes, node: int, borne: float) -> Change | None:
    """Return by how much answers beyond their linear part are to be changed for the target of ``model``; or None.

    With the modes "finer" it is what the next level changes, if there is one, else what has changed since the last one.
    borne : part of the hardest press that the next level is known to bear
    """
    target, modes, gap = model.target, model.modes, shop.gap
    if target == "operator" and gap == 0:
        return None
    if modes == "finer" and gap:
        found = shop.make(("to finer", node), lambda: _to_finer(shop, node, borne))
        linear = _fine_columns(shop, case, node) - shop.reduced_columns(node)
        share = 1.0 if gap == 1 and target == "operator" else _share(target, target_ratio(shop, case, node), gap - 1, 1)
    elif shop.level == 0:
        return None
    else:
        shown = "columns" if modes == "columns" else "snapshots"
        found = shop.make((f"from coarser {shown}", node), lambda: _from_coarser(shop, node, shown))
        linear = shop.reduced_columns(node) - shop.reduced_columns(node, 1)
        share = _share(target, target_ratio(shop, case, node), gap, 0)
    return found._replace(change=share * (found.change - linear @ found.forces.T))


def _share(target: str, ratio: float, count: int, first: int) -> float:
    """Return the sum of so many changes after one of size 1, or of all of them; and of that ``first`` one, too."""
    return first + (_sum_of_powers(ratio, count) if target == "operator" else 1.0 / (ratio - 1.0))


def target_ratio(shop: Workshop, case: Case, node: int) -> float:
    """Return by how much each level divides the error, LEAST_RATIO or more: at ``node`` if it knows three levels.

    Otherwise at one contact for the whole body, which may take a level more than it has.
    """
    stored = case.prepared_contacts
    known = shop.gap == 1 and shop.level > 0 and node in stored
    where = node if known else int(stored[0] if len(stored) else kept_contacts(case.body, 1)[0])
    return shop.make(("ratio", where), lambda: max(LEAST_RATIO, _ratio(shop, case, where)))


def _fine_columns(shop: Workshop, case: Case, node: int) -> np.ndarray:
    """Return the columns of the finest level: stored ones, or extrapolated to it from the levels before."""
    reduced = shop.reduced_columns(node)
    if shop.gap == 0:
        return reduced
    if node in case.prepared_contacts:
        compliance = case.use_compliance()
        return compliance.fine[compliance.row(node)].transpose(1, 2, 0)
    if shop.level == 0:
        return reduced
    return reduced + _sum_of_powers(target_ratio(shop, case, node), shop.gap) * (
        reduced - shop.reduced_columns(node, 1)
    )


def _sum_of_powers(ratio: float, count: int) -> float:
    """Return the sum of so many powers of 1/ratio: all changes that follow one of size 1."""
    return sum(ratio**-k for k in range(1, count + 1))


def _ratio(shop: Workshop, case: Case, node: int) -> float:
    if shop.gap == 1 and shop.level > 0 and node in case.prepared_contacts:
        levels = [shop.reduced_columns(node, 1), shop.reduced_columns(node), _fine_columns(shop, case, node)]
    else:
        # the last three levels, or the first three, some of them finer than the body's
        finest = max(shop.level + shop.gap, 2)
        levels = [shop.pressed_once(node, level) for level in range(finest - 2, finest + 1)]
    before, last = (float(np.linalg.norm(levels[i] - levels[i - 1])) for i in (1, 2))
    return before / last if last > 0.0 else np.inf
