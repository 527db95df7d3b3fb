"""Correct a reduced answer by what snapshots change from one level to the next."""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from palpate.models.reduction.contact_snapshots import LEFT, ContactSnapshots
from palpate.models.reduction.elements_at_rest import ElementsAtRest
from palpate.models.reduction.training_presses import CORNERS, SHARES, likeness

STEPS, RESIDUAL = 20, 1e-3
"""Steps of L-BFGS on the coarser level, which is cheap, and the residual that ends them."""
NEAR = 0.01
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


def change_from_coarser(
    shown: ContactSnapshots,
    coarse: ElementsAtRest,
    carried: tuple[np.ndarray, np.ndarray],
    linear: np.ndarray,
    ups: tuple[sparse.csr_array, sparse.csr_array],
) -> Change:
    """Press as hard as ``shown`` does on the level before, and return the change to the answers there.

    carried : nodes (k,) and shares (k,) of the disc on ``coarse``; linear : (n_coarse, 3, 3) [m/N], its columns
    ups : from the nodes of the shown level, and of the coarse one, to the surface, (n_surface, ·)
    """
    if shown.found:
        hardest = slice(None, len(shown.forces) // len(SHARES))
        forces, answers = shown.forces[hardest], shown.answers[:, :, hardest]
    else:  # a model of the columns is farther off than a level changes
        forces = shown.forces[list(CORNERS)]
        answers = np.stack([_settled(shown, k) for k in CORNERS], axis=2)
    count = len(coarse.rest)
    starts = answers[:count] + (linear - shown.linear[:count]) @ forces.T
    moved = [
        coarse.settle(coarse.nodal(*carried, force), np.ascontiguousarray(starts[:, :, s]), STEPS, RESIDUAL)
        for s, force in enumerate(forces)
    ]
    return Change(forces, answers, to_surface(ups[0], answers) - to_surface(ups[1], np.stack(moved, axis=2)))


def _settled(shown: ContactSnapshots, k: int) -> np.ndarray:
    """Return the elements' answer (n, 3) [m] to the k-th press of ``shown``, from that of the model."""
    load = shown.elements.nodal(shown.nodes, shown.shares, shown.forces[k])
    return shown.elements.settle(load, np.ascontiguousarray(shown.answers[:, :, k]), STEPS, LEFT)


def change_to_finer(
    shown: ContactSnapshots,
    share: float,
    finer: ElementsAtRest,
    carried: tuple[np.ndarray, np.ndarray],
    refine: sparse.csr_array,
    ups: tuple[sparse.csr_array, sparse.csr_array],
) -> Change:
    """Press on the next level, by ``share`` of the hardest straight and most tilted presses of ``shown``.

    carried : as above, of ``finer``; refine : (n_finer, n), from the nodes of one level to those of the next
    ups : as above, of the shown level and of the finer one
    What has changed at one press tells where the search of the next begins. A press that is not found, or that inverts
    an element, is left out.
    """
    elements = shown.elements
    forces: list[np.ndarray] = []
    answers: list[np.ndarray] = []
    changes: list[np.ndarray] = []
    for k in CORNERS:
        force, moved = share * shown.forces[k], shown.answers[:, :, k]
        if share < 0.99:  # rounding aside
            load = elements.nodal(shown.nodes, shown.shares, force)
            moved = elements.settle(load, shown.modelled(force), STEPS, NEAR)
        start, load = refine @ moved, finer.nodal(*carried, force)
        if forces:
            start = start + np.tensordot(likeness(np.array(forces), force, 1), np.array(changes), 1)
        found = finer.settle(load, start, STEPS, NEAR)
        left = np.linalg.norm(finer.force(found) + load) / np.linalg.norm(load)
        if left <= NEAR and finer.least_det(found) > 0.0:
            forces.append(force)
            answers.append(moved)
            changes.append(found - refine @ moved)
    if not forces:
        return Change(np.empty((0, 3)), shown.answers[:, :, :0], np.empty((ups[0].shape[0], 3, 0)))
    before = np.stack(answers, axis=2)
    after = np.stack([refine @ each for each in answers], axis=2) + np.stack(changes, axis=2)
    return Change(np.array(forces), before, to_surface(ups[1], after) - to_surface(ups[0], before))


def to_surface(up: sparse.csr_array, moved: np.ndarray) -> np.ndarray:
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
