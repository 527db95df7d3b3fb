"""Columns and snapshots of one contact: linear and second-order responses, and presses in nine directions."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from palpate.errors import NotConverged
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.reduced.basis import bending_loads, coordinates, orthonormal
from palpate.models.reduced.cubature import energy_of_elements, hyper_reduced, points_and_means, rings_around
from palpate.models.reduced.energy import ReducedEnergy

TILTS = [(0.0, 1, 0.0), (25.0, 4, 45.0), (45.0, 4, 0.0)]
"""Angle to the inward normal, number of directions, and where the first of them points [degrees]."""
CORNERS = (0, 5, 6, 7, 8)
"""Numbers of the straight direction and the most tilted ones."""
SHARES = (1.0, 0.5)
"""Parts of the hardest press in a direction of which snapshots are taken."""
PRESSURE, PEAK, SQUEEZED = 0.25, 0.2, 0.5
"""The hardest press: peak pressure over Young's modulus and peak displacement over the body's size, neither of which
it exceeds, and the smallest det F, which no cubature point falls below. Presses of the trade-off are limited alike."""
FORCE_FACTOR, MOST_LOWERINGS = 0.8, 20
"""Factor by which a press that is too hard is lowered, and how often."""


def directions(normal: np.ndarray) -> np.ndarray:
    """Return the unit vectors (9, 3) of the presses on a surface of outward ``normal`` (3,)."""
    return np.array([_tilted(-normal, tilt, turn + 360.0 * k / n) for tilt, n, turn in TILTS for k in range(n)])


def likeness(known: np.ndarray, force: np.ndarray, order: int) -> np.ndarray:
    """Return weights (s,) of a quantity's values under the forces ``known`` (s, 3) [N] that predict it under ``force``.

    It is taken to grow with the powers ``order`` and ``order`` + 1 of the force (3,) [N]: kernel ridge regression.
    """
    scale = np.linalg.norm(known, axis=1).max()

    def kernel(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        product = a @ b.T / scale**2
        return product**order + product ** (order + 1)

    return np.linalg.solve(kernel(known, known) + 1e-3 * np.eye(len(known)), kernel(known, force))


def hardest(model: ReducedEnergy, moved: np.ndarray, direction: np.ndarray, newtons: float, size: float) -> np.ndarray:
    """Return the hardest force (3,) [N] along ``direction``, at most ``newtons``, that PEAK and SQUEEZED allow.

    moved : (k, 3, r) [m], displacements of the surface by coordinate; size : of the body [m]
    """
    for _ in range(MOST_LOWERINGS):
        settled = model.settle(newtons * direction, 1e-3)
        peak = np.linalg.norm(moved @ settled.q, axis=1).max()
        if settled.residual <= 1e-3 and settled.least_det >= SQUEEZED and peak <= PEAK * size:
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
"""Rings of elements around a disc whose points are cubature points, in the models that presses start from and are
chosen with."""
TOGETHER = 8
"""Elements of which one mean is taken farther away in these models: those that one element was split into."""
MODEL_RESIDUAL = 1e-3


@dataclass(frozen=True, eq=False)
class ContactSnapshots:
    """Presses of one contact of ``elements`` with n nodes, and the reduced model that has predicted them.

    nodes, shares : (k,) the nodes that carry a force, and their parts of it; normal : (3,) outward
    linear : (n, 3, 3) [m/N]; second : (n, 3, 6), second-order responses of any scale
    modes, model : (n, 3, 9) and the reduced energy in them, of the columns alone, with means far from the disc
    forces : (s, 3) [N], the hardest of each direction and then lighter ones; answers : (n, 3, s) [m], displacements
    found : whether the answers are the elements' own, and not the model's
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
        """The linear and second-order responses (n, 3, 9), which no press is simulated for."""
        return np.dstack([self.linear, self.second])

    def modelled(self, force: np.ndarray) -> np.ndarray:
        """Return the displacement (n, 3) [m] that the model of the columns has under ``force`` (3,) [N]."""
        return self.modes @ self.model.settle(force, MODEL_RESIDUAL).q


def basis_of(contacts: Sequence[ContactSnapshots]) -> np.ndarray:
    """Return modes (n, 3, r) of contacts, in which the stiffness at rest is the identity.

    They span the contacts' columns and, where the elements' own were computed, snapshots; of several contacts also the
    second-order responses to pairs of columns of two.
    """
    shapes = [np.dstack([each.columns, each.answers]) if each.found else each.columns for each in contacts]
    elements = contacts[0].elements
    pair_loads = [bending_loads(elements, one.linear, two.linear) for one, two in combinations(contacts, 2)]
    pair_columns = [elements.solve(loads, SECOND_RESIDUAL) for loads in pair_loads]
    return orthonormal(elements, np.dstack(shapes + pair_columns))


def contact_energy(
    contacts: Sequence[ContactSnapshots], modes: np.ndarray, rings: int, tolerance: float, seed: int
) -> ReducedEnergy:
    """Return the energy of few cubature points in ``modes`` (n, 3, r), fitted to contacts' snapshots to ``tolerance``.

    Candidates are integration points up to ``rings`` of elements around a disc, and means elsewhere. Where the rings
    have all elements, they are the points near a disc and others that ``seed`` draws, fitted to the forces of the
    elements. Snapshots of several contacts are added up in random order.
    """
    elements, rng = contacts[0].elements, np.random.default_rng(seed)
    states = np.sum([rng.permutation(coordinates(elements, each.answers, modes).T) for each in contacts], axis=0)
    nodes = np.concatenate([each.nodes for each in contacts])
    loads = np.hstack([carried(each.nodes, each.shares, modes) for each in contacts])
    exact = rings_around(elements, nodes, rings)
    if exact.all():  # no means are left: fit to the elements' own forces
        near_disc = rings_around(elements, nodes, NEAR_RINGS)
        return energy_of_elements(elements, modes, near_disc, states, tolerance, rng, loads)
    return hyper_reduced(
        ReducedEnergy(points_and_means(elements, modes, exact), loads, elements.law), states, tolerance
    )


def carried(nodes: np.ndarray, shares: np.ndarray, modes: np.ndarray) -> np.ndarray:
    """Return unit forces in coordinates, (r, 3), which ``nodes`` (k,) carry by ``shares`` (k,) in the ``modes``."""
    return np.tensordot(modes[nodes], shares, (0, 0)).T


def columns_of_contact(
    elements: ElementsAtRest,
    nodes: np.ndarray,
    shares: np.ndarray,
    normal: np.ndarray,
    newtons: float,
    linear: np.ndarray,
) -> ContactSnapshots:
    """Compute the columns of a contact on ``nodes`` (k,), and the answers to presses of a reduced model made of them.

    newtons : the hardest press [N] that is tried; the model finds how hard each direction can be pressed
    linear : (n, 3, 3) [m/N], the contact's ``linear_columns``
    """
    second_order = elements.solve(bending_loads(elements, linear), SECOND_RESIDUAL)
    modes = orthonormal(elements, np.dstack([linear, second_order]))
    points = points_and_means(
        elements, modes, rings_around(elements, nodes, NEAR_RINGS), TOGETHER if elements.level else 1
    )
    model = ReducedEnergy(points, carried(nodes, shares, modes), elements.law)
    strongest = [hardest(model, modes[nodes], direction, newtons, elements.size) for direction in directions(normal)]
    forces = np.array([share * force for share in SHARES for force in strongest])
    answers = modes @ np.array([model.settle(force, MODEL_RESIDUAL).q for force in forces]).T
    return ContactSnapshots(elements, nodes, shares, normal, linear, second_order, modes, model, forces, answers)


def press_contact(columns: ContactSnapshots) -> ContactSnapshots:
    """Return the contact with the elements' answers to its presses, found by a few steps of L-BFGS from the model's.

    What the model missed in earlier presses predicts what it misses in the next: that is added to where the steps
    begin.
    """
    forces: list[np.ndarray] = []
    answers: list[np.ndarray] = []
    missed: list[np.ndarray] = []
    for k, force in enumerate(columns.forces):
        start = columns.answers[:, :, k]  # the model's answer
        if missed:
            start = start + np.tensordot(likeness(columns.forces[:k], force, 2), np.array(missed), 1)
        reached_force, moved = _snapshot(columns, force, start)
        # a press that had to be lowered has no answer of the model to compare with: nothing is learnt from it
        missed.append(moved - columns.answers[:, :, k] if reached_force is force else np.zeros_like(moved))
        forces.append(reached_force)
        answers.append(moved)
    return replace(columns, forces=np.array(forces), answers=np.stack(answers, axis=2), found=True)


def _snapshot(contact: ContactSnapshots, force: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the hardest press along ``force`` (3,) [N], at most that, with an answer, and its displacement (n, 3) [m].

    start : (n, 3) [m], where the search begins. NotConverged where even the weakest press has no answer.
    """
    elements, residual = contact.elements, np.inf
    for _ in range(MOST_LOWERINGS):
        load = elements.nodal(contact.nodes, contact.shares, force)
        moved = elements.settle(load, start, SNAPSHOT_STEPS, SNAPSHOT_RESIDUAL, SNAPSHOT_LEAST_STEPS)
        residual = elements.residual(moved, load)
        if residual <= SNAPSHOT_RESIDUAL and elements.least_det(moved) > 0.0:
            return force, moved
        force = FORCE_FACTOR * force
        start = contact.modelled(force)
    raise NotConverged("a snapshot of a contact was not found", [residual])
