"""Columns and snapshots of one contact, and the reduced models that are made of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from palpate.errors import NotConverged
from palpate.reduction.cells import cells_of, rings_around, some_points
from palpate.reduction.columns import linear_columns, orthonormal, second_columns
from palpate.reduction.elements_at_rest import ElementsAtRest
from palpate.reduction.reduced_contact import ReducedContact
from palpate.reduction.training_presses import FALL, FALLS, SHARES, directions, hardest

STEPS = 4
"""Steps of L-BFGS on the elements that take a snapshot from the reduced answer to the right one."""
MORE, LEFT = 26, 0.03
"""Most further steps, and the residual over the load that ends them: where a thin lobe turns under its press 20 are
needed, and none at most contacts."""
INVERTED = 0.0
"""Smallest det F of the elements in a snapshot; one below it, or not found, is of a weaker press."""
NEAR = 1
"""Rings of elements around a disc whose points are cells, in the models that presses start from and are chosen with."""
FEW = 4000
"""Points beside those near a disc that cells are chosen from; with all of them answers are no better."""
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
    states = np.sum([rng.permutation(coordinates(each, modes).T) for each in shown], axis=0)
    if not _around(shown, rings).all():
        return whole_model(shown, modes, rings).thinned(states, tolerance)
    pulls = [-np.tensordot(modes, elements.force(modes @ q), ((0, 1), (0, 1))) - q for q in states]
    cells = some_points(elements, modes, _around(shown, NEAR), FEW, rng)
    unlike = np.zeros((modes.shape[2], modes.shape[2]))
    return ReducedContact(cells, _loads(shown, modes), elements.law, unlike).thinned(states, tolerance, pulls)


def coordinates(shown: ContactSnapshots, modes: np.ndarray) -> np.ndarray:
    """Return the coordinates (r, s) of a contact's snapshots in orthonormal ``modes`` (n, 3, r)."""
    each = np.moveaxis(shown.answers, 2, 0)
    stiff = np.stack([shown.elements.multiply(np.ascontiguousarray(answer)) for answer in each], axis=2)
    return np.tensordot(modes, stiff, ((0, 1), (0, 1)))


def _around(shown: Sequence[ContactSnapshots], rings: int) -> np.ndarray:
    """Mark the elements (m,) up to so many ``rings`` around the discs."""
    return rings_around(shown[0].elements, np.unique(np.concatenate([each.nodes for each in shown])), rings)


def _loads(shown: Sequence[ContactSnapshots], modes: np.ndarray) -> np.ndarray:
    """Return the unit forces of all contacts in coordinates, (r, 3 per contact); held nodes do not move."""
    return np.hstack([np.tensordot(modes[each.nodes], each.shares, (0, 0)).T for each in shown])


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
    wanted = [share * force for force in hard for share in SHARES]
    forces, answers = zip(*[_snapshot(bare, model, modes, force) for force in wanted], strict=True)
    return replace(bare, forces=np.array(forces), answers=np.stack(answers, axis=2))


def _snapshot(
    contact: ContactSnapshots, model: ReducedContact, modes: np.ndarray, force: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return a force (3,) [N] along ``force``, at most as large, and the displacement (n, 3) [m] under it.

    NotConverged where even the weakest has none.
    """
    elements, left = contact.elements, np.inf
    for _ in range(FALLS):
        load = elements.nodal(contact.nodes, contact.shares, force)
        moved = elements.settle(load, modes @ model.settle(force, RESIDUAL).q, STEPS)
        moved = elements.settle(load, moved, MORE, LEFT)
        left = float(np.linalg.norm(elements.force(moved) + load) / np.linalg.norm(load))
        if left <= LEFT and elements.least_det(moved) > INVERTED:
            return force, moved
        force = FALL * force
    raise NotConverged("a snapshot of a contact was not found", [left])
