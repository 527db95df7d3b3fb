"""Find how hard a contact can be pressed before elements a level finer have no sound answer.

A thin lobe that is pressed may fold or snap, on fine elements at smaller forces than on coarse ones; what is reduced
from the coarse ones does not see it.
"""

from collections.abc import Sequence

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.quadratic import prolongation
from palpate.models.contact_workshop import Workshop
from palpate.reduction.training_presses import FALL

SOUND, LEFT = 0.2, 0.05
"""Smallest det F of a sound answer, and the residual over the load at which it counts as found."""
STEPS, FALLS = 16, 8
"""Most steps of L-BFGS of a trial, of which 8 are usual, and how often a press that has no answer is lowered."""


def bearing(shop: Workshop, body: Body, nodes: Sequence[int]) -> np.ndarray:
    """Return (k, 3) [1/N], the inward normals at ``nodes`` over the largest inward forces known to have an answer.

    A force of which the product with its row is above 1 goes beyond them.
    """

    def most(node: int) -> float:
        return shop.make(("bears", node), lambda: _bears(shop, body, node))

    return np.array([-shop.snapshots(node).normal / most(node) for node in nodes])


def _bears(shop: Workshop, body: Body, node: int) -> float:
    """Return the force [N] of the hardest straight press of a contact, or of the hardest that is sound, if less."""
    shown, level = shop.snapshots(node), shop.level
    hard = float(np.linalg.norm(shown.forces[0]))
    if shop.gap == 0:
        return hard
    finer, up = shop.elements(level + 1), prolongation(body.levels[level], body.levels[level + 1])
    disc, start, newtons = shop.disc(node, level + 1), up @ shown.answers[:, :, 0], hard
    for _ in range(FALLS):
        load = finer.nodal(*disc, -newtons * shown.normal)
        moved = finer.settle(load, newtons / hard * start, STEPS, LEFT)
        left = np.linalg.norm(finer.force(moved) + load) / np.linalg.norm(load)
        if left <= LEFT and finer.least_det(moved) >= SOUND:
            break
        newtons *= FALL
    return newtons
