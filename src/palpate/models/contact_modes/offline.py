"""Compute offline what reduced models of a body's contacts are made of, once for all settings that share it.

Beside elements and snapshots these are the responses that a model aims at, of the finest level or of the limit of ever
finer levels, and the hardest presses that have an answer. Errors of nested levels fall by one ratio with each
(Richardson 1911): linear responses are extrapolated by those of all levels, and what is beyond them by the two levels
that a contact's snapshots are pressed on. A thin lobe may fold or snap on fine elements at smaller forces than on
coarse ones, which a model reduced from these does not see.
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
    """How answers to s presses of a contact change from one level to the next.

    forces : (s, 3) [N]; answers : (n, 3, s) [m], on the level that is reduced; change : (n_surface, 3, s) [m]
    """

    forces: np.ndarray
    answers: np.ndarray
    change: np.ndarray


def bring_to_surface(up: sparse.csr_array, moved: np.ndarray) -> np.ndarray:
    """Return (n_surface, 3, k) of displacements ``moved`` (n, 3, k) by the interpolation ``up`` (n_surface, n)."""
    return (up @ moved.reshape(len(moved), -1)).reshape(-1, *moved.shape[1:])


def penalised_fit(seen: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the matrix (n, 3, r) whose products with ``seen`` (r, s) are ``wanted`` (n, 3, s), by penalised squares.

    Each of the s pairs is divided by its size, so that weak presses count as much as hard ones.
    """
    norms = np.linalg.norm(seen, axis=0)
    weights = np.divide(1.0, norms, out=np.zeros_like(norms), where=norms > 0.0)
    u, singular, v_t = np.linalg.svd(seen * weights, full_matrices=False)
    damped = singular / (singular**2 + (SMOOTH * singular[0]) ** 2)
    return (((wanted * weights) @ v_t.T) * damped) @ u.T


RATIO_RESIDUAL = 1e-5
"""Relative residual of the responses that show a ratio."""
ORDER = 2
Made = TypeVar("Made")


def reduced_level(body: Body, most: int) -> int:
    """Return the finest level of ``body`` whose quadratic elements have at most ``most`` nodes, or the coarsest."""
    sizes = [len(mesh.nodes) + len(mesh.edges) for mesh in body.levels]
    return max((level for level, size in enumerate(sizes) if size <= most), default=0)


class Offline:
    """Quadratic elements on one ``level`` of ``body``, which are reduced, and what models of contacts need of them.

    radius_m : of the disc that is pressed; 0 presses one node
    gap : number of levels between the one that is reduced and the body's finest
    pressable : the nodes of the fine surface that are not held
    seconds : the time that each named quantity has taken
    """

    def __init__(self, body: Body, radius_m: float, level: int):
        self._body, self._radius_m, self.level = body, radius_m, level
        self.gap = len(body.levels) - 1 - level
        self.pressable = set(np.setdiff1d(body.fine.surface, body.anchors[-1]).tolist())
        self._made: dict[Any, Any] = {}
        self.seconds: dict[Any, float] = {}

    def once(self, name: Any, how: Callable[[], Made]) -> Made:
        """Return the quantity called ``name``, computed by ``how`` at its first use and timed without others inside."""
        if name not in self._made:
            begin, nested_before = perf_counter(), sum(self.seconds.values())
            self._made[name] = how()
            self.seconds[name] = perf_counter() - begin - (sum(self.seconds.values()) - nested_before)
        return self._made[name]

    def elements(self, level: int) -> ElementsAtRest:
        """Return the quadratic elements of a level."""
        return self.once(("elements", level), lambda: ElementsAtRest(with_unknowns(self._body, level, ORDER), level))

    def up(self, level: int) -> Any:
        """Return the interpolation (n_surface, n) from the nodes of the quadratic elements of a level."""
        return self.once(("up", level), lambda: to_surface(self._body, level, ORDER))

    def refine(self, level: int) -> Any:
        """Return the interpolation (n_finer, n) from the nodes of a level's quadratic elements to the next level's."""
        levels = self._body.levels
        return self.once(("refine", level), lambda: quadratic_prolongation(levels[level], levels[level + 1]))

    def disc(self, node: int, level: int) -> tuple[np.ndarray, np.ndarray]:
        """Return nodes (k,) and shares (k,) of the disc around fine surface ``node``."""
        return patch_shares(self._body.levels[level], self._patch(node), ORDER)

    def contact(self, node: int, modes: str) -> ContactSnapshots:
        """Return columns of the disc around ``node``, and answers to presses there.

        modes : "snapshots" for the answers of the elements, "columns" for those of a reduced model of the columns
        """
        columns = self.once(("columns", node), lambda: self._columns(node))
        return columns if modes == "columns" else self.once((modes, node), lambda: press_contact(columns))

    def linear(self, node: int, before: int = 0) -> np.ndarray:
        """Return linear responses (n, 3, 3) [m/N] to unit forces at ``node``, at all nodes of the elements.

        before : 0 for the level that is reduced, 1 for the level before
        """
        level = self.level - before
        elements, disc = self.elements(level), self.disc(node, level)
        return self.once(("columns before" if before else "linear", node), lambda: linear_columns(elements, *disc))

    def reduced_columns(self, node: int, before: int = 0) -> np.ndarray:
        """Return the responses of ``linear`` at the fine surface, (n_surface, 3, 3) [m/N]."""
        return bring_to_surface(self.up(self.level - before), self.linear(node, before))

    def pressed_once(self, node: int, level: int) -> np.ndarray:
        """Return the linear response (n_surface, 3) [m/N] of any ``level`` to a unit force into ``node``.

        The level may be finer than the body's; its elements are not kept.
        """
        refined = finer(self._body, max(0, level + ORDER - len(self._body.levels)))
        elements, patch = ElementsAtRest(refined, level), self._patch(node)
        load = elements.nodal(*patch_shares(refined.levels[level], patch, ORDER), -patch.normal)
        moved = elements.solve(load[:, :, None], RATIO_RESIDUAL)[:, :, 0]
        for coarser in range(level, len(self._body.levels) - 1):
            moved = quadratic_prolongation(refined.levels[coarser], refined.levels[coarser + 1]) @ moved
        return moved[self._body.fine.surface]

    def _patch(self, node: int) -> Patch:
        return patch_at(self._body, node, self._radius_m)

    def _columns(self, node: int) -> ContactSnapshots:
        elements, young = self.elements(self.level), self._body.material.young_pa
        radius = self._radius_m or 0.05 * elements.size
        newtons = PRESSURE * young * np.pi * radius**2 / 2.0
        disc, normal = self.disc(node, self.level), self._patch(node).normal
        return columns_of_contact(elements, *disc, normal, newtons, self.linear(node))


def _from_coarser(offline: Offline, node: int, modes: str) -> Change:
    """Return how displacements under presses at ``node`` change from the coarser level to the one that is reduced.

    The presses are the hardest snapshots of each direction, or for "columns" the straight and most tilted ones.
    """
    contact, level, coarse_columns = offline.contact(node, modes), offline.level, offline.linear(node, before=1)
    coarse, disc = offline.elements(level - 1), offline.disc(node, level - 1)
    if contact.found:  # its answers are those of the elements
        hardest = slice(None, len(contact.forces) // len(SHARES))
        forces, answers = contact.forces[hardest], contact.answers[:, :, hardest]
    else:  # they are a reduced model's, whose error is larger than the change between levels: the elements answer
        forces = contact.forces[list(CORNERS)]
        answers = np.stack([_settled(contact, k) for k in CORNERS], axis=2)
    coarse_count = len(coarse.rest)
    starts = answers[:coarse_count] + (coarse_columns - contact.linear[:coarse_count]) @ forces.T
    coarse_answers = [
        coarse.settle(coarse.nodal(*disc, force), np.ascontiguousarray(starts[:, :, s]), LEVEL_STEPS, COARSER_RESIDUAL)
        for s, force in enumerate(forces)
    ]
    coarse_on_surface = bring_to_surface(offline.up(level - 1), np.stack(coarse_answers, axis=2))
    return Change(forces, answers, bring_to_surface(offline.up(level), answers) - coarse_on_surface)


def _settled(contact: ContactSnapshots, k: int) -> np.ndarray:
    """Return the elements' answer (n, 3) [m] to the k-th press of ``contact``, searched for from the model's."""
    load = contact.elements.nodal(contact.nodes, contact.shares, contact.forces[k])
    return contact.elements.settle(load, np.ascontiguousarray(contact.answers[:, :, k]), LEVEL_STEPS, SNAPSHOT_RESIDUAL)


def _to_finer(offline: Offline, node: int, share: float) -> Change:
    """Return how displacements under presses at ``node`` change from the level that is reduced to the next finer one.

    The presses are ``share`` times the hardest straight and most tilted ones of the snapshots. The change at one press
    predicts where the search of the next begins. A press without an answer, or that inverts an element, is left out.
    """
    level, contact = offline.level, offline.contact(node, "snapshots")
    elements, finer = contact.elements, offline.elements(level + 1)
    disc, refine, up = offline.disc(node, level + 1), offline.refine(level), offline.up(level)
    forces: list[np.ndarray] = []
    answers: list[np.ndarray] = []
    changes: list[np.ndarray] = []
    for k in CORNERS:
        force, reduced_answer = share * contact.forces[k], contact.answers[:, :, k]
        if share < 0.99:  # weaker than the snapshot, so its displacement is computed anew
            load = elements.nodal(contact.nodes, contact.shares, force)
            reduced_answer = elements.settle(load, contact.modelled(force), LEVEL_STEPS, FINER_RESIDUAL)
        start, load = refine @ reduced_answer, finer.nodal(*disc, force)
        if forces:
            start = start + np.tensordot(likeness(np.array(forces), force, 1), np.array(changes), 1)
        finer_answer = finer.settle(load, start, LEVEL_STEPS, FINER_RESIDUAL)
        if finer.residual(finer_answer, load) <= FINER_RESIDUAL and finer.least_det(finer_answer) > 0.0:
            forces.append(force)
            answers.append(reduced_answer)
            changes.append(finer_answer - refine @ reduced_answer)
    if not forces:
        return Change(np.empty((0, 3)), contact.answers[:, :, :0], np.empty((up.shape[0], 3, 0)))
    reduced_answers = np.stack(answers, axis=2)
    finer_answers = np.stack([refine @ each for each in answers], axis=2) + np.stack(changes, axis=2)
    change = bring_to_surface(offline.up(level + 1), finer_answers) - bring_to_surface(up, reduced_answers)
    return Change(np.array(forces), reduced_answers, change)


SOUND, TRIAL_RESIDUAL = 0.2, 0.05
"""Smallest det F of a sound answer, and the residual over the load at which it counts as found."""
SURE, HOPELESS = 0.7, 0.5
"""Smallest det F on the level that is reduced, from which on the next one need not be tried, and below which it is not
worth it. Of 49 straight presses of the liver with two discs none with 0.7 or more was unsound on the finer level, at
worst slow, and none with less than 0.5 was sound there."""
TRIAL_STEPS, TRIAL_FALLS = 16, 8
"""Most steps of L-BFGS of a trial, of which 8 are usual, and how often a press that has no answer is lowered."""


def bearing(offline: Offline, nodes: Sequence[int], modes: str) -> np.ndarray:
    """Return inward normals at ``nodes`` over the hardest inward forces known to have an answer, (k, 3) [1/N].

    A force of which the product with its row is above 1 is harder than any that is known.
    """

    def most(node: int) -> float:
        return offline.once((f"{modes} bear", node), lambda: _hardest_sound(offline, node, modes))

    return np.array([-offline.contact(node, modes).normal / most(node) for node in nodes])


def _hardest_sound(offline: Offline, node: int, modes: str) -> float:
    """Return the force [N] of the hardest straight press at ``node`` whose answer on the next finer level is sound.

    It is at most the hardest straight press of the contact's snapshots.
    """
    contact, level = offline.contact(node, modes), offline.level
    newtons = float(np.linalg.norm(contact.forces[0]))
    if offline.gap == 0:
        return newtons
    start = contact.answers[:, :, 0]
    for _ in range(TRIAL_FALLS):  # lower the force until a finer level bears it
        force = -newtons * contact.normal
        moved, least = _trial(offline, node, level, start, force)
        if least >= SURE:
            break
        if least >= HOPELESS and _trial(offline, node, level + 1, offline.refine(level) @ moved, force)[1] >= SOUND:
            break
        newtons *= FORCE_FACTOR
        start = contact.modelled(-newtons * contact.normal)
    return newtons


def _trial(offline: Offline, node: int, level: int, start: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the displacement (n, 3) [m] of a level under ``force`` (3,) [N], and its least det F or −∞."""
    elements = offline.elements(level)
    load = elements.nodal(*offline.disc(node, level), force)
    moved = elements.settle(load, start, TRIAL_STEPS, TRIAL_RESIDUAL)
    return moved, elements.least_det(moved) if elements.residual(moved, load) <= TRIAL_RESIDUAL else -np.inf


LEAST_RATIO = 1.5
"""Smallest ratio that is extrapolated by; below, levels hardly approach a limit."""


def target_columns(offline: Offline, case: Case, target: str, node: int) -> np.ndarray:
    """Return linear responses (n_surface, 3, 3) [m/N] to unit forces at ``node``.

    target : "operator" for those of the finest level, "limit" for those of ever finer levels
    """
    gap, reduced = offline.gap, offline.reduced_columns(node)
    fine = _fine_columns(offline, case, node)
    if target == "operator":
        return fine
    if gap:
        return fine + (fine - reduced) / (target_ratio(offline, case, node) ** gap - 1.0)
    return fine + (fine - offline.reduced_columns(node, 1)) / (target_ratio(offline, case, node) - 1.0)


def target_change(offline: Offline, case: Case, model: kinds.ContactModes, node: int, borne: float) -> Change | None:
    """Return the change that brings nonlinear answers at ``node`` to the target of ``model``; None where there is none.

    It is extrapolated from what the next level changes with the modes "finer", and otherwise from what the last level
    has changed.
    borne : share of the hardest press that the next level is known to bear
    """
    target, modes, gap = model.target, model.modes, offline.gap
    if target == "operator" and gap == 0:
        return None
    if modes == "finer" and gap:
        level_change = offline.once(("to finer", node), lambda: _to_finer(offline, node, borne))
        linear_change = _fine_columns(offline, case, node) - offline.reduced_columns(node)
        factor = (
            1.0
            if gap == 1 and target == "operator"
            else _change_factor(target, target_ratio(offline, case, node), gap - 1, 1)
        )
    elif offline.level == 0:
        return None
    else:
        kind = "columns" if modes == "columns" else "snapshots"
        level_change = offline.once((f"from coarser {kind}", node), lambda: _from_coarser(offline, node, kind))
        linear_change = offline.reduced_columns(node) - offline.reduced_columns(node, 1)
        factor = _change_factor(target, target_ratio(offline, case, node), gap, 0)
    return level_change._replace(change=factor * (level_change.change - linear_change @ level_change.forces.T))


def _change_factor(target: str, ratio: float, count: int, itself: int) -> float:
    """Return the sum of ``count`` later changes, or of all up to the limit, over the change of one level.

    itself : 1 if that change is added, too, else 0
    """
    return itself + (_sum_of_powers(ratio, count) if target == "operator" else 1.0 / (ratio - 1.0))


def target_ratio(offline: Offline, case: Case, node: int) -> float:
    """Return by how much each level divides the error, LEAST_RATIO or more.

    The ratio is that at ``node`` where three levels' responses are known there. Otherwise it is that at one contact for
    the whole body, which may take a level finer than the body's.
    """
    stored = case.prepared_contacts
    has_three_levels = offline.gap == 1 and offline.level > 0 and node in stored
    reference = node if has_three_levels else int(stored[0] if len(stored) else kept_contacts(case.body, 1)[0])
    return offline.once(("ratio", reference), lambda: max(LEAST_RATIO, _ratio(offline, case, reference)))


def _fine_columns(offline: Offline, case: Case, node: int) -> np.ndarray:
    """Return the finest level's linear responses (n_surface, 3, 3) at ``node``: stored, or extrapolated to it."""
    reduced = offline.reduced_columns(node)
    if offline.gap == 0:
        return reduced
    if node in case.prepared_contacts:
        compliance = case.use_compliance()
        return compliance.fine[compliance.row(node)].transpose(1, 2, 0)
    if offline.level == 0:
        return reduced
    return reduced + _sum_of_powers(target_ratio(offline, case, node), offline.gap) * (
        reduced - offline.reduced_columns(node, 1)
    )


def _sum_of_powers(ratio: float, count: int) -> float:
    """Return the sum of the first ``count`` powers of 1/ratio: of so many changes that follow one of size 1."""
    return sum(ratio**-k for k in range(1, count + 1))


def _ratio(offline: Offline, case: Case, node: int) -> float:
    """Return the ratio of convergence of the linear response at ``node``: its change between two levels over the next.

    Responses are extrapolated to elements of no size by it.
    """
    if offline.gap == 1 and offline.level > 0 and node in case.prepared_contacts:
        levels = [offline.reduced_columns(node, 1), offline.reduced_columns(node), _fine_columns(offline, case, node)]
    else:
        # the last three levels, or the first three, some of them finer than the body's
        finest = max(offline.level + offline.gap, 2)
        levels = [offline.pressed_once(node, level) for level in range(finest - 2, finest + 1)]
    earlier_change, later_change = (float(np.linalg.norm(levels[i] - levels[i - 1])) for i in (1, 2))
    return earlier_change / later_change if later_change > 0.0 else np.inf
