"""Columns and snapshots of one contact, and the reduced models that are made of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from palpate.reduction.cells import cells_of, rings_around
from palpate.reduction.columns import linear_columns, orthonormal, second_columns
from palpate.reduction.elements_at_rest import ElementsAtRest
from palpate.reduction.reduced_contact import ReducedContact
from palpate.reduction.training_presses import RANDOM, SHARES, directions, hardest, random_directions

STEPS = 4
"""Steps of L-BFGS on the elements that take a snapshot from the reduced answer to the right one."""
NEAR = 1
"""Rings of elements around a disc whose points are cells, in the models that presses start from and are chosen with."""
RESIDUAL = 1e-3


@dataclass(frozen=True, eq=False)
class ContactSnapshots:
    """One contact of ``elements`` with n nodes.

    nodes, shares : (k,) the nodes that carry a force, and their parts of it; normal : (3,) outward
    linear : (n, 3, 3) [m/N]; second : (n, 3, 6), in any unit
    forces : (s, 3) [N]; answers : (n, 3, s) [m], the displacements under them
    """

    elements: ElementsAtRest
    nodes: np.ndarray
    shares: np.ndarray
    normal: np.ndarray
    linear: np.ndarray
    second: np.ndarray
    forces: np.ndarray
    answers: np.ndarray

    @property
    def columns(self) -> np.ndarray:
        """The columns (n, 3, 9) that need no press."""
        return np.dstack([self.linear, self.second])


def basis_of(shown: Sequence[ContactSnapshots], snapshots: bool) -> np.ndarray:
    """Return modes (n, 3, r) in which the stiffness at rest is the identity, with the snapshots or without.

    Several contacts, of the same elements, have their modes united, and second-order columns between them.
    """
    parts = [np.dstack([each.columns, each.answers]) if snapshots else each.columns for each in shown]
    elements = shown[0].elements
    between = [second_columns(elements, one.linear, two.linear) for one, two in combinations(shown, 2)]
    return orthonormal(elements, np.dstack(parts + between))


def whole_model(shown: Sequence[ContactSnapshots], modes: np.ndarray, rings: int) -> ReducedContact:
    """Return the model of all elements in ``modes`` (n, 3, r); up to ``rings`` around a disc points are cells.

    Its forces are those of one contact after the other, (3 per contact,).
    """
    elements, nodes = shown[0].elements, np.unique(np.concatenate([each.nodes for each in shown]))
    loads = [np.tensordot(modes[each.nodes], each.shares, (0, 0)).T for each in shown]  # held nodes do not move
    cells = cells_of(elements, modes, rings_around(elements, nodes, rings))
    return ReducedContact(cells, np.hstack(loads), elements.law)


def thinned_model(
    shown: Sequence[ContactSnapshots], modes: np.ndarray, rings: int, tolerance: float, seed: int
) -> ReducedContact:
    """Return the model of few cells, chosen for random presses, to the relative ``tolerance`` of their pull.

    How far these presses go is found with few points, which is near enough to choose by.
    """
    model, growing = whole_model(shown, modes, NEAR), np.arange(1, RANDOM + 1)[:, None] / RANDOM
    hard = [float(np.linalg.norm(each.forces[:: len(SHARES)], axis=1).min()) for each in shown]
    ways = [random_directions(each.normal, seed + k) for k, each in enumerate(shown)]
    presses = np.hstack([growing * newtons * way for newtons, way in zip(hard, ways, strict=True)])
    answers = [model.settle(force, RESIDUAL).q for force in presses]
    return (model if rings == NEAR else whole_model(shown, modes, rings)).thinned(answers, tolerance)


def press_contact(
    elements: ElementsAtRest, nodes: np.ndarray, shares: np.ndarray, normal: np.ndarray, newtons: float
) -> ContactSnapshots:
    """Compute columns and snapshots of a contact on ``nodes`` (k,); ``newtons`` is the hardest press that is tried.

    A model of the columns alone finds how hard each direction can be pressed, and where its snapshot starts from.
    """
    linear = linear_columns(elements, nodes, shares)
    second, nothing = second_columns(elements, linear), np.empty((0, 3))
    bare = ContactSnapshots(elements, nodes, shares, normal, linear, second, nothing, linear[:, :, :0])
    modes = basis_of([bare], False)
    model = whole_model([bare], modes, NEAR)
    hard = [hardest(model, modes[nodes], way, newtons, elements.size) for way in directions(normal)]
    forces = np.array([share * force for force in hard for share in SHARES])
    starts = [modes @ model.settle(force, RESIDUAL).q for force in forces]
    loads = [elements.nodal(nodes, shares, force) for force in forces]
    found = [elements.settle(load, start, STEPS) for load, start in zip(loads, starts, strict=True)]
    return replace(bare, forces=forces, answers=np.stack(found, axis=2))
