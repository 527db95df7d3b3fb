"""Find how hard a contact can be pressed before elements a level finer have no sound answer.

A thin lobe that is pressed may fold or snap, on fine elements at smaller forces than on coarse ones; what is reduced
from the coarse ones does not see it.
"""

from collections.abc import Sequence

import numpy as np

from palpate.models.contact_modes.contact_workshop import Workshop
from palpate.models.reduction.training_presses import FALL

SOUND, LEFT = 0.2, 0.05
"""Smallest det F of a sound answer, and the residual over the load at which it counts as found."""
SURE, HOPELESS = 0.7, 0.5
"""Smallest det F on the level that is reduced, from which on the next one need not be tried, and below which it is not
worth it. Of 49 straight presses of the liver with two discs none with 0.7 or more was unsound on the finer level, at
worst slow, and none with less than 0.5 was sound there."""
STEPS, FALLS = 16, 8
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
    for _ in range(FALLS):
        force = -newtons * shown.normal
        moved, least = _tried(shop, node, level, start, force)
        if least >= SURE:
            break
        if least >= HOPELESS and _tried(shop, node, level + 1, shop.refine(level) @ moved, force)[1] >= SOUND:
            break
        newtons *= FALL
        start = shown.modelled(-newtons * shown.normal)
    return newtons


def _tried(shop: Workshop, node: int, level: int, start: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the displacement (n, 3) [m] of a level under ``force`` (3,) [N], and its smallest det F; -inf if none."""
    elements = shop.elements(level)
    load = elements.nodal(*shop.disc(node, level), force)
    moved = elements.settle(load, start, STEPS, LEFT)
    left = np.linalg.norm(elements.force(moved) + load) / np.linalg.norm(load)
    return moved, elements.least_det(moved) if left <= LEFT else -np.inf
