"""Answer loads with finite elements on one level of a body, to convergence or stopped early.

Presses may be anywhere on the fine surface, several at once, by forces or to a depth.
"""

from collections.abc import Iterable
from copy import copy
from typing import Self

import numpy as np
from scipy import sparse

from palpate.benchmark.load import Load
from palpate.benchmark.model import Case
from palpate.bodies.body import Body
from palpate.bodies.contacts import row_of, surface_contacts
from palpate.bodies.refinement import quadratic_prolongation, with_midpoints
from palpate.effects.patch_load import Patch, patch_at, patch_shares
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.pushed_discs import push


class Simulation:
    """Static equilibrium under presses, by linear or, of ``order`` 2, quadratic elements on ``level``.

    tolerance : relative residual to stop at
    solver : the class that finds the equilibrium, by Newton's method or L-BFGS
    shares : how discs are spread over its nodes
    iterations : most iterations; the last one is then the answer, whatever its residual. None: as many as the tolerance
        takes, with smaller loads in between.
    """

    def __init__(
        self,
        case: Case,
        level: int,
        tolerance: float,
        iterations: int | None = None,
        order: int = 1,
        solver: type[Equilibrium] = Equilibrium,
    ):
        whole = with_unknowns(case.body, level, order)
        self._equilibrium = solver(whole, level, order)
        self._rest, self._held = self._equilibrium.mesh.nodes, whole.anchors[level % len(case.body.levels) + order - 1]
        self._tolerance, self._iterations, self._converged = tolerance, iterations, case.tolerance
        self.shares = ContactShares(case, level, order)

    def stopped(self, tolerance: float, iterations: int | None) -> Self:
        """Return a simulation with another stop, which shares the matrices of this one."""
        other = copy(self)
        other._tolerance, other._iterations = tolerance, iterations
        return other

    def displacement(self, load: Load, start: np.ndarray | None = None) -> np.ndarray:
        """Return displacements (n_nodes, 3) [m] of all nodes; errors and ``start`` as in ``answer``."""
        return self.answer(load, start)[0]

    def answer(self, load: Load, start: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray | None]:
        """Return displacements (n_nodes, 3) [m] of all nodes, and the forces (presses, 3) [N] if a depth is asked for.

        start : displacements (n_nodes, 3) [m] that Newton's method begins at, in place of rest
        Raises NotConverged, or InputError for a node that cannot be pressed.
        """
        by_force, to_depth = load.parted()
        nodal, x = self.shares.spread(by_force, len(self._rest)), None if start is None else self._rest + start
        tolerance, iterations = self._tolerance, self._iterations
        if to_depth:
            displacements = np.array([displacement for _, displacement in to_depth])
            weights = self._weights([node for node, _ in to_depth])
            solution, forces = push(self._equilibrium, nodal, weights, displacements, tolerance, iterations, x)
            return solution.x - self._rest, load.with_found(forces)
        if iterations is None:
            return self._equilibrium.solve(nodal, tolerance, x).x - self._rest, None
        return self._equilibrium.approach(nodal, tolerance, iterations, x).x - self._rest, None

    def settled(self, load: Load) -> np.ndarray:
        """Return displacements (n_nodes, 3) [m] converged to the case's tolerance, whatever this stops at."""
        return self.stopped(self._converged, None).displacement(load)

    def means(self, load: Load, displacement: np.ndarray) -> np.ndarray:
        """Return the mean displacement (presses, 3) [m] of each disc under displacements (n_nodes, 3) [m]."""
        discs = [self.shares.of(press.node) for press in load.presses]
        return np.array([shares @ displacement[nodes] for nodes, shares in discs])

    def least_det(self, displacement: np.ndarray) -> float:
        """Return the smallest det F of the elements under displacements (n_nodes, 3) [m]."""
        return self._equilibrium.least_det(self._rest + displacement)

    def nodal(self, load: Load) -> np.ndarray:
        """Return nodal forces (n_nodes, 3) [N]; InputError for a node that cannot be pressed, Refused for a depth."""
        return self.shares.spread(load.forces(), len(self._rest))

    def _weights(self, contacts: list[int]) -> sparse.csr_array:
        """Return the weights (k, n_nodes) of the mean displacement of discs, without those of nodes that are held."""
        weights = sparse.lil_array((len(contacts), len(self._rest)))
        for row, contact in enumerate(contacts):
            nodes, shares = self.shares.of(contact)
            free = ~np.isin(nodes, self._held)
            weights[row, nodes[free]] = shares[free]
        return weights.tocsr()

    def correction(self, load: Load, moved: np.ndarray) -> np.ndarray:
        """Return the displacement (n_nodes, 3) [m] that one multigrid cycle adds to ``moved``, from its residual."""
        return self._equilibrium.correction(self._rest + moved, self.nodal(load))

    def linear_columns(self, contacts: np.ndarray) -> np.ndarray:
        """Return linear responses to unit forces at ``contacts``, (n_contacts, 3, n_nodes, 3) [m/N]."""
        respond = self._equilibrium.linear_solver()
        return np.array([[respond(self.nodal(Load.at(c, unit))) for unit in np.eye(3)] for c in contacts])


class LinearCoarse:
    """The linear response of the coarse mesh, computed in advance: three stored columns for each contact."""

    def __init__(self, case: Case):
        compliance = case.use_compliance()
        self._contacts, self._columns = compliance.contacts, compliance.coarse

    def displacement(self, load: Load) -> np.ndarray:
        """Return displacements (n_nodes, 3) [m] under ``load``; InputError for a contact that is not prepared."""
        parts = [np.tensordot(f, self._columns[row_of(self._contacts, c)], 1) for c, f in load.forces()]
        return np.sum(parts, axis=0)

    def answer(self, load: Load) -> tuple[np.ndarray, None]:
        """Return the displacements as ``displacement`` does, and None for forces, as a depth is refused."""
        return self.displacement(load), None


class ContactShares:
    """The nodes that carry a press at a free node of the fine surface, and the share of the force that each carries.

    The nodes are those of elements of ``order`` on ``level``. Shares are computed in advance for prepared contacts,
    once for all models of a body, and at their first use for others.
    """

    def __init__(self, case: Case, level: int, order: int = 1):
        body, key = case.body, (level % len(case.body.levels), order, case.radius_m)
        self._body, self._level, self._order, self._radius_m = body, key[0], order, case.radius_m
        self._able = surface_contacts(body)
        self._shares: dict[int, tuple[np.ndarray, np.ndarray]] = case.share(("patches", body, *key), dict)
        # places are those of one model's queries, and no other's
        self._placed: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        for contact in case.prepared_contacts:
            self.of(int(contact))

    def spread(self, forces: Iterable[tuple[int, np.ndarray]], count: int) -> np.ndarray:
        """Return nodal forces (count, 3) [N] of ``forces``, pairs of a fine surface node and its force (3,) [N]."""
        nodal = np.zeros((count, 3))
        for contact, force in forces:
            nodes, shares = self.of(contact)
            nodal[nodes] += np.outer(shares, force)
        return nodal

    def of(self, contact: int) -> tuple[np.ndarray, np.ndarray]:
        """Return node numbers and shares of a press at fine surface node ``contact``; InputError where it is held."""
        if contact in self._placed:
            return self._placed[contact]
        if contact not in self._shares:
            row_of(self._able, contact)
            mesh, surface = self._body.levels[self._level], self._body.fine.surface
            if self._radius_m == 0.0 and contact >= len(mesh.nodes):  # between nodes: as its displacement follows
                row = to_surface(self._body, self._level, self._order)[[np.searchsorted(surface, contact)]]
                self._shares[contact] = row.indices.astype(np.int64), row.data
            else:
                patch = patch_at(self._body, contact, self._radius_m)
                self._shares[contact] = patch_shares(mesh, patch, self._order)
        return self._shares[contact]

    def place(self, number: int, patch: Patch) -> int:
        """Return the name by which loads press a disc anywhere on the surface, until ``number`` is placed anew."""
        name = -1 - number
        self._placed[name] = patch_shares(self._body.levels[self._level], patch, self._order)
        return name


def with_unknowns(body: Body, level: int, order: int) -> Body:
    """Return ``body`` with the level whose nodes are those of elements of ``order`` on ``level``."""
    return with_midpoints(body, level) if order == 2 else body


def coordinates_of(nodes: np.ndarray) -> np.ndarray:
    """Return the numbers (3k,) of the coordinates of ``nodes`` (k,)."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


def held_on(body: Body, level: int) -> np.ndarray:
    """Return which nodes of a level are anchors, (n,) bool."""
    return np.isin(np.arange(len(body.levels[level].nodes)), body.anchors[level])


def to_surface(body: Body, level: int, order: int = 1) -> sparse.csr_array:
    """Return the interpolation (n_surface, n_nodes) from the nodes of elements to the fine surface nodes.

    It is linear or, of ``order`` 2, quadratic. Quadratic elements on ``level`` have the nodes of the next level, which
    on the finest level are more than the fine ones.
    """
    if order == 2 and level == len(body.levels) - 1:
        columns = len(body.fine.nodes) + len(body.fine.edges)
        return sparse.eye_array(columns, format="csr")[body.fine.surface].tocsr()
    return to_fine(body, level, order)[body.fine.surface].tocsr()


def to_fine(body: Body, level: int, order: int = 1) -> sparse.csr_array:
    """Return the interpolation (n_fine, n_nodes) from the nodes of elements to all fine nodes, as ``to_surface`` does.

    Quadratic elements have to be below the finest level, where they have more nodes than the fine mesh.
    """
    to_finer = sparse.eye_array(len(body.fine.nodes), format="csr")
    for start in range(len(body.levels) - order - 1, level - 1, -1):
        step = body.prolongations[start] if order == 1 else quadratic_prolongation(*body.levels[start : start + 2])
        to_finer = to_finer @ step
    return to_finer.tocsr()
