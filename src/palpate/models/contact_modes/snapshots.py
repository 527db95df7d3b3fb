"""Columns and snapshots of one contact: linear and second-order responses, and presses in nine directions."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from palpate.errors import NotConverged
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.reduced.basis import bending_loads, coordinates, orthonormal
from palpate.models.reduced.cubature import cells_of, like_elements, rings_around, thinned
from palpate.models.reduced.energy import ReducedEnergy

TILTS = [(0.0, 1, 0.0), (25.0, 4, 45.0), (45.0, 4, 0.0)]
"""Angle to the inward normal, number of directions, and where the first of them points [degrees]."""
CORNERS = (0, 5, 6, 7, 8)
"""Numbers of the straight direction and the most tilted ones."""
SHARES = (1.0, 0.5)
"""Parts of the hardest press in a direction of which snapshots are taken."""
PRESSURE, PEAK, SQUEEZED = 0.25, 0.2, 0.5
"""The hardest press: peak pressure over Young's modulus and peak displacement over the body's size, neither of which
it exceeds, and the smallest det F, which no cell falls below. Presses of the trade-off are limited alike."""
FORCE_FACTOR, MOST_LOWERINGS = 0.8, 20
"""Factor by which a press that is too hard is lowered, and how often."""


def directions(normal: np.ndarray) -> np.ndarray:
    """Return the unit vectors (9, 3) of the presses on a surface of outward ``normal`` (3,)."""
    return np.array([_tilted(-normal, tilt, turn + 360.0 * k / n) for tilt, n, turn in TILTS for k in range(n)])


def likeness(known: np.ndarray, force: np.ndarray, order: int) -> np.ndarray:
    """Return weights (s,) of what is ``known`` under forces (s, 3) [N], whose sum is expected under ``force`` (3,) [N].

    It grows with the power ``order`` of the force, and the next one: kernel ridge regression with a kernel of these.
    """
    scale = np.linalg.norm(known, axis=1).max()

    def kernel(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        product = a @ b.T / scale**2
        return product**order + product ** (order + 1)

    return np.linalg.solve(kernel(known, known) + 1e-3 * np.eye(len(known)), kernel(known, force))


def hardest(model: ReducedEnergy, moved: np.ndarray, direction: np.ndarray, newtons: float, size: float) -> np.ndarray:
    """Return the force (3,) [N] along ``direction`` (3,), of at most ``newtons``, that PEAK and SQUEEZED allow.

    moved : (k, 3, r) [m], displacements of the surface by coordinate; size : of the body [m]
    """
    for _ in range(MOST_LOWERINGS):
        found = model.settle(newtons * direction, 1e-3)
        peak = np.linalg.norm(moved @ found.q, axis=1).max()
        if found.residual <= 1e-3 and found.least_det >= SQUEEZED and peak <= PEAK * size:
            break
        newtons *= FORCE_FACTOR
    return newtons * direction


def _tilted(axis: np.ndarray, tilt: float, turn: float) -> np.ndarray:
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    a, b = np.deg2rad(tilt), np.deg2rad(turn)
    return np.cos(a) * axis + np.sin(a) * (np.cos(b) * across + np.sin(b) * np.cross(axis, across))


LINEAR_RESIDUAL, SECOND_RESIDUAL = 1e-5, 3e-2
"""Relative residuals of the linear columns, and of those of second order, which are themselves corrections."""


def linear_columns(elements: ElementsAtRest, nodes: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return responses (n, 3, 3) [m/N] to unit forces along x, y, z on ``nodes`` (k,) by ``shares`` (k,)."""
    return elements.solve(elements.nodal(nodes, shares, np.eye(3)), LINEAR_RESIDUAL)


SNAPSHOT_LEAST_STEPS = 3
"""Least steps of L-BFGS on the elements that take a snapshot from the reduced answer to the right one."""
SNAPSHOT_STEPS, SNAPSHOT_RESIDUAL = 30, 0.03
"""Most of these steps, and the residual over the load that ends them: where a thin lobe turns under its press 20 are
needed, and fewer at most contacts."""
NEAR_RINGS = 1
"""Rings of elements around a disc whose points are cells, in the models that presses start from and are chosen with."""
TOGETHER = 8
"""Elements of which one mean is taken farther away in these models: those that one element was split into."""
MODEL_RESIDUAL = 1e-3


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
    model: ReducedEnergy
    forces: np.ndarray
    answers: np.ndarray
    found: bool = False

    @property
    def columns(self) -> np.ndarray:
        """The columns (n, 3, 9) that need no press."""
        return np.dstack([self.linear, self.second])

    def modelled(self, force: np.ndarray) -> np.ndarray:
        """Return the displacement (n, 3) [m] that the model of the columns has under ``force`` (3,) [N]."""
        return self.modes @ self.model.settle(force, MODEL_RESIDUAL).q


def basis_of(shown: Sequence[ContactSnapshots]) -> np.ndarray:
    """Return modes (n, 3, r) in which the stiffness at rest is the identity, with the snapshots that were found.

    Several contacts, of the same elements, have their modes united, and second-order columns between them.
    """
    parts = [np.dstack([each.columns, each.answers]) if each.found else each.columns for each in shown]
    elements = shown[0].elements
    pairs = [bending_loads(elements, one.linear, two.linear) for one, two in combinations(shown, 2)]
    between = [elements.solve(loads, SECOND_RESIDUAL) for loads in pairs]
    return orthonormal(elements, np.dstack(parts + between))


def few_cells(
    shown: Sequence[ContactSnapshots], modes: np.ndarray, rings: int, tolerance: float, seed: int
) -> ReducedEnergy:
    """Return the model of few cells in ``modes`` (n, 3, r), which pull as all do at the snapshots, to ``tolerance``.

    They are of points up to ``rings`` around a disc and means elsewhere. Where all are points the elements themselves
    say how all pull, and few are chosen from: those near a disc, and others that ``seed`` draws. Forces are those of
    one contact after the other; the snapshots of several are added up at random.
    """
    elements, rng = shown[0].elements, np.random.default_rng(seed)
    states = np.sum([rng.permutation(coordinates(elements, each.answers, modes).T) for each in shown], axis=0)
    nodes = np.concatenate([each.nodes for each in shown])
    loads = np.hstack([carried(each.nodes, each.shares, modes) for each in shown])
    exact = rings_around(elements, nodes, rings)
    if exact.all():
        near = rings_around(elements, nodes, NEAR_RINGS)
        return like_elements(elements, modes, near, states, tolerance, rng, loads)
    return thinned(ReducedEnergy(cells_of(elements, modes, exact), loads, elements.law), states, tolerance)


def carried(nodes: np.ndarray, shares: np.ndarray, modes: np.ndarray) -> np.ndarray:
    """Return unit forces on ``nodes`` (k,) by ``shares`` (k,) in coordinates, (r, 3); held nodes do not move."""
    return np.tensordot(modes[nodes], shares, (0, 0)).T


def columns_of_contact(
    elements: ElementsAtRest,
    nodes: np.ndarray,
    shares: np.ndarray,
    normal: np.ndarray,
    newtons: float,
    linear: np.ndarray,
) -> ContactSnapshots:
    """Compute columns of a contact on ``nodes`` (k,), and what a model of them alone answers to presses.

    newtons : the hardest press that is tried; the model finds how hard each direction can be pressed
    linear : (n, 3, 3) [m/N], its ``linear_columns``
    """
    second = elements.solve(bending_loads(elements, linear), SECOND_RESIDUAL)
    modes = orthonormal(elements, np.dstack([linear, second]))
    cells = cells_of(elements, modes, rings_around(elements, nodes, NEAR_RINGS), TOGETHER if elements.level else 1)
    model = ReducedEnergy(cells, carried(nodes, shares, modes), elements.law)
    hard = [hardest(model, modes[nodes], way, newtons, elements.size) for way in directions(normal)]
    forces = np.array([share * force for share in SHARES for force in hard])
    answers = modes @ np.array([model.settle(force, MODEL_RESIDUAL).q for force in forces]).T
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
    for _ in range(MOST_LOWERINGS):
        load = elements.nodal(contact.nodes, contact.shares, force)
        moved = elements.settle(load, start, SNAPSHOT_STEPS, SNAPSHOT_RESIDUAL, SNAPSHOT_LEAST_STEPS)
        left = elements.residual(moved, load)
        if left <= SNAPSHOT_RESIDUAL and elements.least_det(moved) > 0.0:
            return force, moved
        force = FORCE_FACTOR * force
        start = contact.modelled(force)
    raise NotConverged("a snapshot of a contact was not found", [left])
