"""Columns and snapshots of one contact, and the reduced models that are made of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from palpate.errors import NotConverged
from palpate.models.reduction.cells import cells_of, rings_around, some_points
from palpate.models.reduction.columns import linear_columns, orthonormal, second_columns
from palpate.models.reduction.elements_at_rest import ElementsAtRest
from palpate.models.reduction.reduced_contact import ReducedContact
from palpate.models.reduction.training_presses import FALL, FALLS, SHARES, directions, hardest, likeness

STEPS = 3
"""Least steps of L-BFGS on the elements that take a snapshot from the reduced answer to the right one."""
MOST, LEFT = 30, 0.03
"""Most of these steps, and the residual over the load that ends them: where a thin lobe turns under its press 20 are
needed, and STEPS at most contacts."""
INVERTED = 0.0
"""Smallest det F of the elements in a snapshot; one below it, or not found, is of a weaker press."""
NEAR = 1
"""Rings of elements around a disc whose points are cells, in the models that presses start from and are chosen with."""
TOGETHER = 8
"""Elements of which one mean is taken farther away in these models: those that one element was split into."""
FEW = 2000
"""Points beside those near a disc that cells are chosen from; with all of them answers are no better."""
RESIDUAL = 1e-3


@dataclass(frozen=True, eq=False)
class ContactSnapshots:
    """One contact of ``elements`` with n nodes.

    nodes, shares : (k,) the nodes that carry a force, and their parts of it; normal : (3,) outward
    linear : (n, 3, 3) [m/N]; second : (n, 3, 6), in any unit
    modes, model : (n, 3, 9) and a model of them, made of the columns alone, with means far from the disc
    forces : (s, 3) [N], the hardest of each direction and then lighter ones; answers : (n, 3, s) [m], displacements
    found : whether the answers are the elements' own; otherwise they are those of the model
    """

    elements: ElementsAtRest
    nodes: np.ndarray
    shares: np.ndarray
    normal: np.ndarray
    linear: np.ndarray
    second: np.ndarray
    modes: np.ndarray
    model: ReducedContact
    forces: np.ndarray
    answers: np.ndarray
    found: bool = False

    @property
    def columns(self) -> np.ndarray:
        """The columns (n, 3, 9) that need no press."""
        return np.dstack([self.linear, self.second])

    def modelled(self, force: np.ndarray) -> np.ndarray:
        """Return the displacement (n, 3) [m] that the model of the columns has under ``force`` (3,) [N]."""
        return self.modes @ self.model.settle(force, RESIDUAL).q


def basis_of(shown: Sequence[ContactSnapshots]) -> np.ndarray:
    """Return modes (n, 3, r) in which the stiffness at rest is the identity, with the snapshots that were found.

    Several contacts, of the same elements, have their modes united, and second-order columns between them.
    """
    parts = [np.dstack([each.columns, each.answers]) if each.found else each.columns for each in shown]
    elements = shown[0].elements
    between = [second_columns(elements, one.linear, two.linear) for one, two in combinations(shown, 2)]
    return orthonormal(elements, np.dstack(parts + between))


def whole_model(shown: Sequence[ContactSnapshots], modes: np.ndarray, rings: int) -> ReducedContact:
    """Return the model of all elements in ``modes`` (n, 3, r); up to ``rings`` around a disc points are cells.

    Its forces are those of one contact after the other, (3 per contact,).
    """
    elements = shown[0].elements
    return ReducedContact(cells_of(elements, modes, _around(shown, rings)), _loads(shown, modes), elements.law)


def thinned_model(
    shown: Sequence[ContactSnapshots], modes: np.ndarray, rings: int, tolerance: float, seed: int
) -> ReducedContact:
    """Return the model of few cells, which pull as all do at the snapshots, to the relative ``tolerance``.

    Where all points are cells the elements themselves say how all pull, and few points are chosen from: those near a
    disc, and others that ``seed`` draws. Snapshots of several contacts are added up at random.
    """
    elements, rng = shown[0].elements, np.random.default_rng(seed)
    states = np.sum([rng.permutation(coordinates(elements, each.answers, modes).T) for each in shown], axis=0)
    if not _around(shown, rings).all():
        return whole_model(shown, modes, rings).thinned(states, tolerance)
    flat = modes.reshape(-1, modes.shape[2])
    moved = (flat @ states.T).T.reshape(len(states), -1, 3)
    pulls = -np.array([elements.force(each).ravel() for each in moved]) @ flat - states
    cells = some_points(elements, modes, _around(shown, NEAR), FEW, rng)
    unlike = np.zeros((modes.shape[2], modes.shape[2]))
    return ReducedContact(cells, _loads(shown, modes), elements.law, unlike).thinned(states, tolerance, pulls)


def coordinates(elements: ElementsAtRest, answers: np.ndarray, modes: np.ndarray) -> np.ndarray:
    """Return the coordinates (r, s) of ``answers`` (n, 3, s) [m] in orthonormal ``modes`` (n, 3, r)."""
    return np.tensordot(modes, elements.multiply(np.ascontiguousarray(answers)), ((0, 1), (0, 1)))


def _around(shown: Sequence[ContactSnapshots], rings: int) -> np.ndarray:
    """Mark the elements (m,) up to so many ``rings`` around the discs."""
    return rings_around(shown[0].elements, np.unique(np.concatenate([each.nodes for each in shown])), rings)


def _loads(shown: Sequence[ContactSnapshots], modes: np.ndarray) -> np.ndarray:
    """Return the unit forces of all contacts in coordinates, (r, 3 per contact); held nodes do not move."""
    return np.hstack([_carried(each.nodes, each.shares, modes) for each in shown])


def _carried(nodes: np.ndarray, shares: np.ndarray, modes: np.ndarray) -> np.ndarray:
    return np.tensordot(modes[nodes], shares, (0, 0)).T


def columns_of_contact(
    elements: ElementsAtRest, nodes: np.ndarray, shares: np.ndarray, normal: np.ndarray, newtons: float
) -> ContactSnapshots:
    """Compute columns of a contact on ``nodes`` (k,), and what a model of them alone answers to presses.

    newtons : the hardest press that is tried; the model finds how hard each direction can be pressed
    """
    linear = linear_columns(elements, nodes, shares)
    second = second_columns(elements, linear)
    modes = orthonormal(elements, np.dstack([linear, second]))
    cells = cells_of(elements, modes, rings_around(elements, nodes, NEAR), TOGETHER if elements.level else 1)
    model = ReducedContact(cells, _carried(nodes, shares, modes), elements.law)
    hard = [hardest(model, modes[nodes], way, newtons, elements.size) for way in directions(normal)]
    forces = np.array([share * force for share in SHARES for force in hard])
    answers = modes @ np.array([model.settle(force, RESIDUAL).q for force in forces]).T
    return ContactSnapshots(elements, nodes, shares, normal, linear, second, modes, model, forces, answers)


def press_contact(columns: ContactSnapshots) -> ContactSnapshots:
    """Take the answers of a model of ``columns`` to those of the elements, by a few steps of L-BFGS.

    What the model has missed in the presses before, it is expected to miss in the next one: that is added to where the
    search begins.
    """
    forces: list[np.ndarray] = []
    answers: list[np.ndarray] = []
    missed: list[np.ndarray] = []
    for k, force in enumerate(columns.forces):
        start = columns.answers[:, :, k]
        if missed:
            start = start + np.tensordot(likeness(columns.forces[:k], force, 2), np.array(missed), 1)
        found, moved = _snapshot(columns, force, start)
        # of a press that had to be weaker, which has no answer of the model, nothing is learnt
        missed.append(moved - columns.answers[:, :, k] if found is force else np.zeros_like(moved))
        forces.append(found)
        answers.append(moved)
    return replace(columns, forces=np.array(forces), answers=np.stack(answers, axis=2), found=True)


def _snapshot(contact: ContactSnapshots, force: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a force (3,) [N] along ``force``, at most as large, and the displacement (n, 3) [m] under it.

    start : (n, 3) [m], where the search begins. NotConverged where even the weakest has none.
    """
    elements, left = contact.elements, np.inf
    for _ in range(FALLS):
        load = elements.nodal(contact.nodes, contact.shares, force)
        moved = elements.settle(load, start, MOST, LEFT, STEPS)
        left = float(np.linalg.norm(elements.force(moved) + load) / np.linalg.norm(load))
        if left <= LEFT and elements.least_det(moved) > INVERTED:
            return force, moved
        force = FALL * force
        start = contact.modelled(force)
    raise NotConverged("a snapshot of a contact was not found", [left])
