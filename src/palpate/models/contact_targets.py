"""Say what a reduced answer is meant for: the fine operator's, or the limit of ever finer levels, extrapolated.

Errors of nested levels fall by one ratio with each (Richardson 1911). The linear part of an answer is extrapolated by
the columns of all levels there are; what is beyond it, by the two levels that a contact's snapshots are pressed on.
"""

import numpy as np

from palpate.models.contact_workshop import Workshop
from palpate.models.model import Case

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
    return fine + (fine - shop.before(node).linear) / (target_ratio(shop, case, node) - 1.0)


def target_share(shop: Workshop, case: Case, target: str, node: int) -> float:
    """Return the part of the last level's change by which what is beyond the linear part is extrapolated."""
    if shop.level == 0 or (target == "operator" and shop.gap == 0):
        return 0.0
    ratio = target_ratio(shop, case, node)
    return _steps(ratio, shop.gap) if target == "operator" else 1.0 / (ratio - 1.0)


def target_ratio(shop: Workshop, case: Case, node: int) -> float:
    """Return by how much each level divides the error, at least LEAST: at ``node`` if three levels are known there.

    Otherwise at one contact for the whole body, which may take a level more than it has.
    """
    stored = node in case.prepared_contacts
    known = shop.gap == 1 and shop.level > 0 and stored
    where = node if known else int(case.prepared_contacts[0]) if len(case.prepared_contacts) else node
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
    return reduced + _steps(target_ratio(shop, case, node), shop.gap) * (reduced - shop.before(node).linear)


def _steps(ratio: float, count: int) -> float:
    """Return the sum of so many powers of 1/ratio: all changes that follow one of size 1."""
    return sum(ratio**-k for k in range(1, count + 1))


def _ratio(shop: Workshop, case: Case, node: int) -> float:
    if shop.gap == 1 and shop.level > 0 and node in case.prepared_contacts:
        levels = [shop.before(node).linear, shop.reduced_columns(node), _fine_columns(shop, case, node)]
    else:
        levels = [shop.pressed_once(node, level) for level in shop.three_levels]
    before, last = (float(np.linalg.norm(levels[i] - levels[i - 1])) for i in (1, 2))
    return before / last if last > 0.0 else np.inf
