"""Find the forces of discs that are pushed to a depth, for models that answer forces."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import NoConvergence, broyden1

from palpate.benchmark.load import Answer, Load, Refused
from palpate.benchmark.model import Case
from palpate.errors import NotConverged
from palpate.models.fem_statics import ContactShares

FORCE_TOLERANCE, FORCE_EVALUATIONS = 1e-4, 40
"""What may be left, over the largest displacement that is asked for or undone, and the most evaluations."""
WORST_CONDITION = 1e12
"""Condition of the responses of discs above which they are the same one."""


def forces_for(
    moved: Callable[[np.ndarray], np.ndarray],
    wanted: np.ndarray,
    force: np.ndarray,
    unknown: np.ndarray,
    slope: np.ndarray,
) -> np.ndarray:
    """Return forces (f,) [N] whose displacement ``moved`` (f,) [m] is ``wanted`` in components ``unknown`` (f,) bool.

    force : (f,) the given ones, and 0 where they are unknown; slope : (f, f) [m/N], the response to small forces
    Broyden's method (1965), from the linear response. Unlike ``find_forces`` it halves a step that leads no nearer, or
    to forces for which ``moved`` raises NotConverged, as a reduced model does beyond its range. Refused for two discs
    that are pushed at the same place.
    """
    compliance = _apart(slope[np.ix_(unknown, unknown)])

    def missing(force: np.ndarray) -> np.ndarray:
        return (wanted - moved(force))[unknown]

    force, inverse = force.copy(), np.linalg.inv(compliance)
    error = missing(force)
    # the largest way that is asked for or, of a disc held against other presses, undone
    scale = float(max(np.abs(wanted[unknown]).max(), np.abs(error).max()))
    step = inverse @ error
    for _ in range(FORCE_EVALUATIONS):  # Broyden's steps, halved where they lead no nearer
        if np.abs(error).max() <= FORCE_TOLERANCE * scale:
            return force
        trial = force.copy()
        trial[unknown] += step
        try:
            trial_error = missing(trial)
        except NotConverged:
            step = 0.5 * step
            continue
        if not np.linalg.norm(trial_error) < 1.5 * np.linalg.norm(error):
            step = 0.5 * step
            continue
        change = inverse @ (error - trial_error)
        inverse += np.outer(step - change, step @ inverse) / (step @ change)
        force, error = trial, trial_error
        step = inverse @ error
    raise NotConverged("no force was found that moves the disc as far as it is pushed", [float(np.abs(error).max())])


def _apart(compliance: np.ndarray) -> np.ndarray:
    """Return ``compliance`` (f, f) [m/N] between discs; Refused if two of the discs are the same one."""
    if not np.linalg.cond(compliance) < WORST_CONDITION:
        raise Refused("two discs are pushed to a depth at the same place; push one of them")
    return compliance


Presses = list[tuple[int, np.ndarray]]
"""Nodes and forces (3,) [N]."""
DEPTH_TOLERANCE, DEPTH_ITERATIONS = 1e-6, 30
"""Distance from the depths, as a share of the way there, at which a search ends; and its most iterations."""


class Discs:
    """Mean displacements of the discs of prepared contacts, and the forces that push these discs to a depth.

    A disc's mean is exact for the linear response, as it is stored; the model's deviation from it is interpolated
    linearly between surface nodes.
    """

    def __init__(self, case: Case):
        self._compliance = case.use_compliance()
        self._shares, self._surface = ContactShares(case, len(case.body.levels) - 1), case.body.fine.surface

    def means(self, disc: int, contact: int) -> np.ndarray:
        """Return the linear mean displacement (3, 3) [m/N] of the disc at one contact by unit forces at another.

        InputError for a contact that is not prepared.
        """
        means = self._compliance.means
        if means is None:
            return self._interpolated_means(disc, contact)
        return means[self._compliance.row(disc), self._compliance.row(contact)]

    def linear_forces(self, load: Load) -> np.ndarray:
        """Return the force (presses, 3) [N] of every press of ``load``, if responses are linear.

        Refused for two discs that are pushed at the same place.
        """
        by_force, to_depth = load.parted()
        missing = [
            displacement - sum(force @ self.means(disc, contact) for contact, force in by_force)
            for disc, displacement in to_depth
        ]
        return load.with_found(np.linalg.solve(self._between_discs(load), np.concatenate(missing)).reshape(-1, 3))

    def answer(self, load: Load, respond: Callable[[Presses], np.ndarray]) -> Answer:
        """Return the answer to a ``load`` with depths, by a model whose displacement under forces is ``respond``."""
        pushed = [(row, p.node) for row, p in enumerate(load.presses) if p.force is None]
        nodes = [press.node for press in load.presses]
        inexact = {
            (disc, contact): self.means(disc, contact) - self._interpolated_means(disc, contact)
            for _, disc in pushed
            for contact in nodes
        }

        def reached(tried: np.ndarray) -> np.ndarray:
            presses = list(zip(nodes, load.with_found(tried), strict=True))
            moved = respond(presses)
            disc_means = [self._mean(disc, moved) for _, disc in pushed]
            return disc_means + np.array([sum(f @ inexact[disc, c] for c, f in presses) for _, disc in pushed])

        displacements = np.array([displacement for _, displacement in load.parted()[1]])
        forces = load.with_found(find_forces(reached, displacements, self._between_discs(load)))
        return Answer(respond(list(zip(nodes, forces, strict=True))), forces)

    def _between_discs(self, load: Load) -> np.ndarray:
        """Return the matrix (3k, 3k) [m/N] from the forces of k pushed discs to their means."""
        discs = [disc for disc, _ in load.parted()[1]]
        return _apart(np.block([[self.means(disc, contact).T for contact in discs] for disc in discs]))

    def _interpolated_means(self, disc: int, contact: int) -> np.ndarray:
        columns = self._compliance.fine[self._compliance.row(contact)]
        return np.array([self._mean(disc, column) for column in columns])

    def _mean(self, disc: int, displacement: np.ndarray) -> np.ndarray:
        """Return the mean (3,) [m] of a displacement (n_surface, 3) [m] that is linear between nodes."""
        nodes, shares = self._shares.of(disc)
        return shares @ displacement[np.searchsorted(self._surface, nodes)]


def find_forces(
    means: Callable[[np.ndarray], np.ndarray], displacements: np.ndarray, compliance: np.ndarray
) -> np.ndarray:
    """Return the forces (k, 3) [N] under which k discs have moved by ``displacements`` (k, 3) [m] on average.

    means : from forces (k, 3) [N] to the mean displacements (k, 3) [m] of the discs, by one answer of the model
    compliance : (3k, 3k) [m/N], what these do in the first order, where Broyden's method begins (1965, Math. Comp. 19)
    Raises NotConverged after DEPTH_ITERATIONS.
    """
    inverse, wanted = np.linalg.inv(compliance), displacements.ravel()
    # the way that is asked for or, of discs held against other presses, undone
    size = float(max(np.linalg.norm(wanted), np.linalg.norm(wanted - means(np.zeros_like(displacements)).ravel())))
    if not 0.0 < size < np.inf:
        return np.zeros_like(displacements)

    def missing(reached: np.ndarray) -> np.ndarray:
        """Return what is missing of the way, over its size, if a linear body would have moved by ``reached``."""
        return (wanted - means((inverse @ reached).reshape(displacements.shape)).ravel()) / size

    try:
        with np.errstate(all="ignore"):  # of answers that do not change
            reached = broyden1(
                lambda y: missing(size * y), wanted / size, alpha=1.0, maxiter=DEPTH_ITERATIONS, f_tol=DEPTH_TOLERANCE
            )
    except (NoConvergence, ValueError) as failure:  # the latter where an answer is not finite
        raise NotConverged(
            f"no force was found that pushes so far in {DEPTH_ITERATIONS} iterations", [float("nan")]
        ) from failure
    return (inverse @ (size * reached)).reshape(displacements.shape)
