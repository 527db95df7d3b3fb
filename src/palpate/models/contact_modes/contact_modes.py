"""Answer with a reduced model for each contact, made of linear, second-order and pressed shapes of quadratic elements.

Contacts are prepared by presses that the model simulates itself: it needs no sample. Several presses at once need the
union of their contacts' shapes.
"""

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from palpate.benchmark.load import Answer, Doubted, Load
from palpate.benchmark.model import Case, Solver, held_mb
from palpate.bodies.contacts import refuse
from palpate.effects.patch_load import patch_at, patch_shares
from palpate.errors import NotConverged
from palpate.models import kinds
from palpate.models.contact_modes.offline import (
    Offline,
    bearing,
    bring_to_surface,
    penalised_fit,
    reduced_level,
    target_change,
    target_columns,
)
from palpate.models.contact_modes.snapshots import (
    FORCE_FACTOR,
    MOST_LOWERINGS,
    ContactSnapshots,
    basis_of,
    contact_energy,
    coordinates,
    directions,
)
from palpate.models.depths import forces_for
from palpate.models.near_buckling import NearBuckling
from palpate.models.reduced.energy import ReducedEnergy, softness

RESIDUAL = 1e-3
"""Residual of an answer over its load."""


class Prepared(NamedTuple):
    """All that answers presses of k contacts at once, on n surface nodes, in r coordinates.

    reach : the largest norm of coordinates of a snapshot, of all contacts together
    columns : (3 n, 3 k) [m/N], linear responses; rest : (3 n, r), displacements by the nonlinear part of coordinates,
        float32
    discs : (3 k, 3 k) [m/N] and (3 k, r), the same of the mean displacements of the discs
    bearing : (k, 3) [1/N], whose products with forces are at most 1 where finer elements are known to have an answer
    together : (k, k), by which one disc's product adds to another's, as they press on the same tissue
    soft : (r, r), as ``softness`` returns it
    firm_n, inward : a force is known to leave the body stiff if it is at most ``firm_n`` [N] and its product with
        ``inward`` (3 k,); 0 for several contacts
    """

    reduced: ReducedEnergy
    reach: float
    columns: np.ndarray
    rest: np.ndarray
    discs: tuple[np.ndarray, np.ndarray]
    bearing: np.ndarray
    together: np.ndarray
    soft: np.ndarray
    firm_n: float
    inward: np.ndarray

    def is_known_stiff(self, force: np.ndarray) -> bool:
        """Return whether it was found in advance that the body stays far from buckling under ``force`` (3 k,) [N]."""
        return sqrt(force @ force) <= min(self.firm_n, force @ self.inward)

    def beyond(self, q: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Return the nonlinear part (r,) of coordinates ``q``: less the linear response to ``force`` (3 k,) [N]."""
        return q - self.reduced.loads @ force


def spent(offline: Offline, model: kinds.ContactModes, nodes: tuple[int, ...]) -> float:
    """Return the time [s] that preparing the contacts ``nodes`` has taken, with what other settings prepared before."""
    kind = _snapshot_kind(model)
    parts = {"linear", "columns", kind, "columns before", f"from coarser {kind}", f"{kind} bear"}
    parts |= {"to finer"} if model.modes == "finer" else set()
    names = [*_names(model, nodes), *((part, node) for part in sorted(parts) for node in nodes)]
    return sum(offline.seconds.get(name, 0.0) for name in names)


def _snapshot_kind(model: kinds.ContactModes) -> str:
    """Return which snapshots the modes of ``model`` are made of; "finer" has those of "snapshots"."""
    return "columns" if model.modes == "columns" else "snapshots"


def _names(model: kinds.ContactModes, nodes: tuple[int, ...]) -> tuple[tuple, tuple]:
    """Return the names of the reduced energy, which several settings may share, and of the whole model."""
    reduced = (_snapshot_kind(model), model.rings, model.thinned)
    return ("reduced", nodes, reduced), ("target", nodes, reduced, model.modes, model.target)


def _stably_borne(reduced: ReducedEnergy, soft: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Return the ``limits`` (k, 3) [1/N] of straight presses, lowered to forces at which the body is still stiff.

    A row l of ``bearing`` limits the force to l/|l|². A portable file, which has no tangent, doubts by these alone.
    """
    lowered = limits.copy()
    for k, row in enumerate(lowered):
        for _ in range(MOST_LOWERINGS):  # lower the force until the body is stiff under it
            force = np.zeros(reduced.loads.shape[1])
            force[3 * k : 3 * k + 3] = row / (row @ row)
            settled = reduced.settle(force, RESIDUAL)
            if settled.residual <= RESIDUAL and reduced.is_stiff(settled.q, LEAST_STIFFNESS * soft):
                break
            row /= FORCE_FACTOR
    return lowered


def _firm(reduced: ReducedEnergy, soft: np.ndarray, contact: ContactSnapshots) -> float:
    """Return the force [N] up to which the body keeps the share FIRM of its stiffness in presses of nine directions.

    Forces are tried in SIZES steps up to the hardest snapshot. No fold hides between them: towards it stiffness falls
    as the root of what is left of the force.
    """
    press_directions, firm_n = directions(contact.normal), 0.0
    hardest = float(np.linalg.norm(contact.forces, axis=1).max())
    for newtons in hardest / SIZES * np.arange(1, SIZES + 1):  # up to the first that is not firm
        answers = [reduced.settle(newtons * direction, RESIDUAL) for direction in press_directions]
        if not all(each.residual <= RESIDUAL and reduced.is_stiff(each.q, FIRM * soft) for each in answers):
            break
        firm_n = float(newtons)
    return firm_n


def _together(case: Case, nodes: Sequence[int]) -> np.ndarray:
    """Return the overlap (k, k) of discs: 1 if their centres are at most a radius apart, 0 from two radii on."""
    centres = case.body.fine.nodes[list(nodes)]
    distances = np.linalg.norm(centres[:, None] - centres[None], axis=2)
    return np.clip(2.0 - distances / case.radius_m, 0.0, 1.0) if case.radius_m else (distances == 0.0).astype(float)


def _at_discs(weights: list[tuple[np.ndarray, np.ndarray]], moved: np.ndarray) -> np.ndarray:
    """Return the discs' means (3 k, j) of ``moved`` (n, 3, j), by their ``weights``: rows of nodes and shares."""
    return np.concatenate([np.tensordot(share, moved[rows], 1) for rows, share in weights])


LEAST_DET, LARGEST_NORM, LARGEST_PRESS = 0.68, 2.0, 1.05
"""Smallest det F of the cubature points of an answer, its largest energy norm over that of the farthest snapshot, and
its hardest inward force over the one that finer elements are known to bear; beyond any, the model says that it does not
know."""

LEAST_STIFFNESS = 0.15
"""Least stiffness of an answer over that of the body's softest motion at rest: it is 0 where the body buckles or snaps,
and what an answer has wrong there grows as its inverse: of a column that is pressed 1° off its axis 0.2 % at 0.8, 1.1 %
at 0.25, 1.4 % at 0.13 and 2.1 % at 0.08."""
FIRM, SIZES, TILT = 0.5, 10, 0.7
"""Least stiffness of answers that are far from buckling, at how many forces it is looked for in advance, and the least
cosine of the angle of presses that this covers to the inward normal: those tried are tilted by 45° at most."""
LARGEST_SHARE = 0.9
"""Share of the load under which the body buckles, linearised at rest, in shapes that a contact's modes may lack."""
LINEAR_BELOW = 1e-9
"""Linear answers that are this much smaller than the farthest snapshot are the answer; rounding hides the rest."""

OWN_ERROR = 1e-3
"""RMSE over peak that an answer as far as the farthest snapshot says of itself; bounds find the factor to it."""


class ContactSolver(Solver):
    """Reduced models of contacts; a contact that is not prepared is, when it is first asked for, and charged then.

    offline : what settings share of the body
    prepared : what answers, by the nodes that are pressed at once
    """

    def __init__(self, case: Case, model: kinds.ContactModes):
        what = case.body, case.radius_m, reduced_level(case.body, model.nodes)
        self.offline = offline = case.share(("offline", *what), lambda: Offline(*what))
        self._case, self._model = case, model
        self.prepared: dict[tuple[int, ...], Prepared] = {}
        self._seconds = 0.0
        offline.elements(offline.level), offline.up(offline.level)
        self._buckling = NearBuckling(case, LARGEST_SHARE)

    @property
    def memory_mb(self) -> float:
        """The memory [MB] that the prepared contacts hold; what prepares others can be dropped."""
        return held_mb((self.prepared, self._buckling))

    def precede(self, load: Load) -> None:
        """Prepare the contacts of ``load``; not timed, but charged."""
        self.prepare_contact(*(press.node for press in load.presses))

    def prepare_contact(self, *nodes: int) -> Prepared:
        """Return what answers presses at fine surface ``nodes`` at once, made at its first use.

        InputError for a node that is held or not of the surface.
        """
        if nodes not in self.prepared:
            for node in nodes:
                if node not in self.offline.pressable:
                    refuse(node)
            offline, model = self.offline, self._model
            reduced_name, target_name = _names(model, nodes)
            made = offline.once(reduced_name, lambda: self._reduced_energy(nodes))
            self.prepared[nodes] = offline.once(target_name, lambda: self._completed(nodes, *made))
            self._seconds += spent(self.offline, self._model, nodes)
            self._case.charge("contacts", self._seconds)
        return self.prepared[nodes]

    def _reduced_energy(self, nodes: Sequence[int]) -> tuple[np.ndarray, ReducedEnergy]:
        """Return the modes (n, 3, r) of the contacts at ``nodes``, and the energy of few cubature points in them."""
        offline, case, model = self.offline, self._case, self._model
        contacts = [offline.contact(node, _snapshot_kind(model)) for node in nodes]
        modes = basis_of(contacts)
        return modes, contact_energy(contacts, modes, model.rings, model.thinned, case.options.seed)

    def _completed(self, nodes: Sequence[int], modes: np.ndarray, reduced: ReducedEnergy) -> Prepared:
        """Return all that answers presses: a reduced model at the surface, corrected to the target of ``model``."""
        offline, case, model = self.offline, self._case, self._model
        kind = _snapshot_kind(model)
        contacts, up = [offline.contact(node, kind) for node in nodes], offline.up(offline.level)
        nonlinear, loads, fine = bring_to_surface(up, modes), reduced.loads, case.body.fine
        soft = softness(nonlinear)
        discs = [patch_shares(fine, patch_at(case.body, node, case.radius_m)) for node in nodes]
        weights = [(np.searchsorted(fine.surface, disc_nodes), shares) for disc_nodes, shares in discs]
        limits = _stably_borne(reduced, soft, bearing(offline, nodes, kind))

        # the nonlinear part, plus a linear map of it that is fitted to how presses change from level to level
        at_discs, changes = loads.T, []
        for node, limit, contact in zip(nodes, limits, contacts, strict=True):
            hardest = float(-(limit @ contact.normal) * np.linalg.norm(contact.forces[0]))
            changes.append(target_change(offline, case, model, node, 1.0 / hardest))
        if known_changes := [(k, each) for k, each in enumerate(changes) if each]:
            nonlinear_q = [
                coordinates(contacts[0].elements, each.answers, modes) - loads[:, 3 * k : 3 * k + 3] @ each.forces.T
                for k, each in known_changes
            ]
            correction = penalised_fit(np.hstack(nonlinear_q), np.dstack([each.change for _, each in known_changes]))
            nonlinear, at_discs = nonlinear + correction, at_discs + _at_discs(weights, correction)

        # the linear part: responses of the target, and what those of the reduced level lack
        columns = np.dstack([target_columns(offline, case, model.target, node) for node in nodes])
        lacked = columns - np.dstack([offline.reduced_columns(node) for node in nodes])
        linear = loads.T @ loads + _at_discs(weights, lacked)

        reach = 0.0  # the farthest coordinates of each contact's snapshots, added up
        for k, contact in enumerate(contacts):
            forces = np.zeros((len(contact.forces), 3 * len(contacts)))
            forces[:, 3 * k : 3 * k + 3] = contact.forces
            reach += max(float(np.linalg.norm(reduced.settle(force, RESIDUAL).q)) for force in forces)
        rest = np.ascontiguousarray(nonlinear.reshape(-1, modes.shape[2]), dtype=np.float32)
        columns_2d = np.ascontiguousarray(columns.reshape(len(rest), -1))
        firm_n = _firm(reduced, soft, contacts[0]) if len(contacts) == 1 else 0.0
        inward = -np.concatenate([contact.normal for contact in contacts]) / TILT
        together = _together(case, nodes)
        return Prepared(reduced, reach, columns_2d, rest, (linear, at_discs), limits, together, soft, firm_n, inward)

    def prepare_nodes(self, nodes: tuple[int, ...]) -> float:
        self.prepare_contact(*nodes)
        return spent(self.offline, self._model, nodes)

    def respond(self, load: Load) -> Answer:
        """Answer with an estimate of the error, which grows with the coordinates; Doubted beyond the model's range."""
        model = self.prepare_contact(*(press.node for press in load.presses))
        given_forces = [press.force for press in load.presses if press.force is not None]
        force = np.concatenate(given_forces) if len(given_forces) == len(load.presses) else _all_forces(model, load)
        q, doubt, residual = _settled(model, force)
        moved = model.columns @ force + model.rest @ model.beyond(q, force).astype(np.float32)
        forces = None if len(given_forces) == len(load.presses) else force.reshape(-1, 3)
        answer = Answer(moved.reshape(-1, 3), forces, OWN_ERROR * sqrt(q @ q) / model.reach)
        if doubt:
            raise Doubted(doubt, [residual], answer)
        self._buckling.checked(load, answer)
        return answer


def _all_forces(model: Prepared, load: Load) -> np.ndarray:
    """Return the forces (3 k,) [N] of all presses of ``load``; those of discs pushed to a depth are searched for."""
    unknown = np.repeat([press.force is None for press in load.presses], 3)
    given_values = np.concatenate([press.moved if press.force is None else press.force for press in load.presses])
    linear, nonlinear = model.discs

    def moved(force: np.ndarray) -> np.ndarray:
        q, doubt, residual = _settled(model, force)
        if doubt:
            raise NotConverged(doubt, [residual])
        return linear @ force + nonlinear @ model.beyond(q, force)

    return forces_for(moved, given_values, np.where(unknown, 0.0, given_values), unknown, linear)


def _settled(model: Prepared, force: np.ndarray) -> tuple[np.ndarray, str, float]:
    """Return coordinates (r,) under ``force`` (3 k,) [N], why they are to be doubted or "", and the relative residual.

    NotConverged where the search finds no rest.
    """
    linear = model.reduced.loads @ force
    if sqrt(linear @ linear) <= LINEAR_BELOW * model.reach:
        return linear, "", 0.0
    q, residual, least_det = model.reduced.at_rest(force, RESIDUAL)
    norm_ratio = sqrt(q @ q) / model.reach
    inward = np.maximum((model.bearing * force.reshape(-1, 3)).sum(axis=1), 0.0)
    press_ratio = float((model.together @ inward).max())
    doubt = ""
    if not least_det >= LEAST_DET:
        doubt = f"cells are squeezed to det F = {least_det:.2f}, beyond what the contact's model was made for"
    elif not norm_ratio <= LARGEST_NORM:
        doubt = f"this goes {norm_ratio:.1f} times as far as what the contact's model is made of"
    elif not press_ratio <= LARGEST_PRESS:
        doubt = f"this presses {press_ratio:.2f} times as hard as finer elements are known to bear"
    elif not (model.is_known_stiff(force) or model.reduced.is_stiff(q, LEAST_STIFFNESS * model.soft)):
        doubt = f"the body is about to give way: its stiffness is below {LEAST_STIFFNESS:g} of that at rest"
    return q, doubt, residual


prepare = ContactSolver
