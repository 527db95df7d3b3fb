"""Static equilibrium of a body in which discs are pushed so far; the forces that this takes are found.

The energy is minimised among the positions in which the weighted mean displacement of each disc is the one asked for:
Newton's method on that subspace, with conjugate gradients that are projected to it by the constraint preconditioner of
Gould, Hribar and Nocedal (2001, SIAM J. Sci. Comput. 23, 1376). No force is guessed, so that a disc may be pushed past
a load at which a given force would make the body snap. A column that is pushed along its axis buckles all the same, and
later than under a force, as its end is held from the side: the answer has to be stable among those positions.
"""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from palpate.errors import InputError, NotConverged
from palpate.linalg.minimiser import Product, Solution, capped, minimise_by_newton
from palpate.linalg.multigrid import conjugate_gradients
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.stability import made_stable, settle_from_unstable

BEGIN_TOLERANCE, PART_TOLERANCE = 1e-2, 1e-4
"""Relative residuals of the linear response that a search begins at, and of an equilibrium on the way."""
OVERLAP = 1e-6
"""Inverse condition of the products of the discs' weights below which two of them are one."""


class Pushed:
    """The equilibrium of ``body`` on the positions in which k discs are where they are pushed to.

    body : the static problem
    weights : (k, n_nodes) of the mean displacement of each disc; rows add up to 1 but for what nodes that are held
        would carry, where weights are 0
    Raises InputError for two discs at the same place.
    """

    def __init__(self, body: Equilibrium, weights: sparse.csr_array):
        self._body, self._weights, self._spread = body, weights, weights.T.tocsr()
        gram = (weights @ self._spread).toarray()
        if not (gram.diagonal() > 0.0).all() or np.linalg.cond(gram) > 1.0 / OVERLAP:
            raise InputError("load: two discs are pushed at the same place, or where nothing gives; push one of them.")
        self._inverse = np.linalg.inv(gram)

    def energy(self, x: np.ndarray) -> float:
        """Return the energy [J] of the body and of the forces that are given."""
        return self._body.energy(x)

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the part (n_nodes, 3) [N] of the forces that moves no disc on."""
        return self._free(self._body.force(x))

    def found(self, x: np.ndarray) -> np.ndarray:
        """Return the forces (k, 3) [N] that hold the discs at ``x`` (n_nodes, 3) [m]."""
        return -self._inverse @ (self._weights @ self._body.force(x))

    def scale(self, x: np.ndarray) -> float:
        """Return the norm of the nodal forces [N] that act on the body at ``x`` (n_nodes, 3) [m]."""
        return float(np.linalg.norm(self._body.load + self._spread @ self.found(x)))

    def means(self, moved: np.ndarray) -> np.ndarray:
        """Return the mean displacements (k, 3) [m] of the discs under displacements (n_nodes, 3) [m]."""
        return self._weights @ moved

    def linearise(self, x: np.ndarray, definite: bool = False) -> tuple[Product, Product]:
        """Return the products with the stiffness at ``x`` and with a preconditioner, both on the subspace."""
        multiply, precondition = self._body.linearise(x, definite)
        return lambda step: self._free(multiply(step)), self._projected(precondition)[0]

    def at_rest(self) -> Product:
        """Return the preconditioner of the state at rest on the subspace."""
        return self._projected(self._body.at_rest())[0]

    def begin(self, x: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """Return positions near ``x`` (n_nodes, 3) [m] in which the discs have moved by ``moved`` (k, 3) [m].

        What is missing is added as the body linearised at ``x`` gives way, so this is Newton's first step, too.
        """
        multiply, precondition = self._body.linearise(x)
        within, follow = self._projected(precondition)
        step = follow(moved - self.means(x - self._body.mesh.nodes))
        right = self.force(x) - self._free(multiply(step))
        if np.linalg.norm(right) > 0.0:
            step += conjugate_gradients(lambda a: self._free(multiply(a)), within, right, BEGIN_TOLERANCE, 200)[0]
        return x + step

    def _projected(self, precondition: Product) -> tuple[Product, Callable[[np.ndarray], np.ndarray]]:
        """Return the preconditioner on the subspace, and what makes displacements that move the discs by (k, 3) [m]."""
        units = np.eye(3 * self._weights.shape[0]).reshape(-1, self._weights.shape[0], 3)
        give = np.array([precondition(self._spread @ unit) for unit in units])
        stiffness = np.linalg.inv(np.array([self.means(each).ravel() for each in give]).T)

        def follow(moved: np.ndarray) -> np.ndarray:
            return np.tensordot(stiffness @ moved.ravel(), give, 1)

        def within(right: np.ndarray) -> np.ndarray:
            step = precondition(right)
            return step - follow(self.means(step))

        return within, follow

    def _free(self, forces: np.ndarray) -> np.ndarray:
        """Return what is left of ``forces`` (n_nodes, 3) without those that act on the discs as a whole."""
        return forces - self._spread @ (self._inverse @ (self._weights @ forces))


def push(
    body: Equilibrium,
    load: np.ndarray,
    weights: sparse.csr_array,
    moved: np.ndarray,
    tolerance: float,
    iterations: int | None = None,
    start: np.ndarray | None = None,
) -> tuple[Solution, np.ndarray]:
    """Find a stable equilibrium with k discs pushed by ``moved`` (k, 3) [m] under ``load`` (n_nodes, 3) [N] elsewhere.

    weights : as in ``Pushed``
    tolerance : of the residual, over the norm of all nodal forces
    iterations : cap on Newton's iterations; with one, the answer is what the last one reached, as in
        ``Equilibrium.approach``, stable or not, and otherwise both are applied in parts where needed, and what is not
        stable is left, as in ``Equilibrium.solve``
    start : positions (n_nodes, 3) [m] to begin at, default rest
    Returns the solution, and the forces (k, 3) [N] that the discs bear. Raises NotConverged as those do, InputError
    for two discs at the same place.
    """
    problem, x = Pushed(body, weights), body.mesh.nodes if start is None else start
    if not (moved.any() or load.any()):
        return Solution(body.mesh.nodes.copy(), [0.0], [0.0]), np.zeros_like(moved)
    solution, reached, step = Solution(x), 0.0, 1.0
    while True:
        last = reached + step >= 1.0
        body.carry((reached + step) * load)
        try:
            begin = problem.begin(x, (reached + step) * moved)
            if iterations is not None:
                found = capped(problem, begin, problem.scale(begin), tolerance, iterations - 1)
                return found, problem.found(found.x)
            _settle(problem, begin, tolerance if last else max(tolerance, PART_TOLERANCE), solution)
        except NotConverged as failure:
            if iterations is not None:
                raise
            step *= 0.5
            if step < 1 / 64:
                message = f"{failure}, at {reached + 2 * step:.0%} of the way in steps of {2 * step:.1%}"
                raise NotConverged(message, failure.history) from failure
            x = body.mesh.nodes if reached == 0.0 else x
            continue
        x, reached = solution.x, reached + step
        if last:
            solution = made_stable(
                problem, problem.at_rest, body.mesh.size, solution, lambda x: _slide(problem, x, tolerance)
            )
            return solution, problem.found(solution.x)


def _slide(problem: Pushed, x: np.ndarray, tolerance: float) -> Solution:
    """Find the equilibrium that ``x`` (n_nodes, 3) [m] comes to from beside an unstable one."""
    solution = settle_from_unstable(problem, problem.at_rest(), x, problem.scale(x), tolerance)
    _settle(problem, solution.x, tolerance, solution)
    return solution


def _settle(problem: Pushed, begin: np.ndarray, tolerance: float, solution: Solution) -> None:
    """Search until the residual is small against the forces that are found, which are not known before."""
    solution.x = begin
    for _ in range(5):
        scale = problem.scale(solution.x)
        minimise_by_newton(problem, solution.x, scale, tolerance, solution=solution)
        if problem.scale(solution.x) >= 0.5 * scale:
            return
