"""Say what a reduced answer is meant for: the fine operator's, or the limit of ever finer levels, extrapolated.

Errors of nested levels fall by one ratio with each (Richardson 1911). The linear part of an answer is extrapolated by
the columns of all levels there are; what is beyond it, by the two levels that a contact's snapshots are pressed on.
"""

import numpy as np

from palpate.benchmark.model import Case, Setting
from palpate.bodies.contacts import kept_contacts
from palpate.models.contact_modes.contact_workshop import Workshop
from palpate.models.reduction.nested_targets import Change

TARGETS = ("operator", "limit")
LEAST = 1.5
"""Smallest ratio that is extrapolated by; below, levels hardly approach a limit."""


def target_columns(shop: Workshop, case: Case, target: str, node: int) -> np.ndarray:
    """Return the linear responses (n_surface, 3, 3) [m/N] of ``target`` to unit forces at ``node``."""
    gap, reduced = shop.gap, shop.reduced_columns(node)
    fine = _fine_columns(shop, case, node)
    if target == "operator":
        return fine
    if gap:
        return fine + (fine - reduced) / (target_ratio(shop, case, node) ** gap - 1.0)
    return fine + (fine - shop.columns_before(node)) / (target_ratio(shop, case, node) - 1.0)


def target_change(shop: Workshop, case: Case, setting: Setting, node: int, borne: float) -> Change | None:
    """Return by how much answers beyond their linear part are to be changed for the target of ``setting``; or None.

    With the modes "finer" it is what the next level changes, if there is one, else what has changed since the last one.
    borne : part of the hardest press that the next level is known to bear
    """
    target, modes, gap = setting["target"], setting["modes"], shop.gap
    if target == "operator" and gap == 0:
        return None
    if modes == "finer" and gap:
        found = shop.to_finer(node, borne)
        linear = _fine_columns(shop, case, node) - shop.reduced_columns(node)
        share = 1.0 if gap == 1 and target == "operator" else _share(target, target_ratio(shop, case, node), gap - 1, 1)
    elif shop.level == 0:
        return None
    else:
        found = shop.from_coarser(node, "columns" if modes == "columns" else "snapshots")
        linear = shop.reduced_columns(node) - shop.columns_before(node)
        share = _share(target, target_ratio(shop, case, node), gap, 0)
    return found._replace(change=share * (found.change - linear @ found.forces.T))


def _share(target: str, ratio: float, count: int, first: int) -> float:
    """Return the sum of so many changes after one of size 1, or of all of them; and of that ``first`` one, too."""
    return first + (_steps(ratio, count) if target == "operator" else 1.0 / (ratio - 1.0))


def target_ratio(shop: Workshop, case: Case, node: int) -> float:
    """Return by how much each level divides the error, at least LEAST: at ``node`` if three levels are known there.

    Otherwise at one contact for the whole body, which may take a level more than it has.
    """
    stored = case.prepared_contacts
    known = shop.gap == 1 and shop.level > 0 and node in stored
    where = node if known else int(stored[0] if len(stored) else kept_contacts(case.body, 1)[0])
    return shop.make(("ratio", where), lambda: max(LEAST, _ratio(shop, case, where)))


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
    return reduced + _steps(target_ratio(shop, case, node), shop.gap) * (reduced - shop.columns_before(node))


def _steps(ratio: float, count: int) -> float:
    """Return the sum of so many powers of 1/ratio: all changes that follow one of size 1."""
    return sum(ratio**-k for k in range(1, count + 1))


def _ratio(shop: Workshop, case: Case, node: int) -> float:
    if shop.gap == 1 and shop.level > 0 and node in case.prepared_contacts:
        levels = [shop.columns_before(node), shop.reduced_columns(node), _fine_columns(shop, case, node)]
    else:
        levels = [shop.pressed_once(node, level) for level in shop.three_levels]
    before, last = (float(np.linalg.norm(levels[i] - levels[i - 1])) for i in (1, 2))
    return before / last if last > 0.0 else np.inf
