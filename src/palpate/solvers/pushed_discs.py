"""Static equilibrium of a body with discs on its surface at given displacements, and the forces that hold them there.

The energy is minimised among the positions in which the weighted mean displacement of each disc is the given one: by
Newton's method on that subspace, with conjugate gradients that are projected to it by the constraint preconditioner of
Gould, Hribar and Nocedal (2001, SIAM J. Sci. Comput. 23, 1376). As no force is given, a disc may be pushed past a load
under which the body would snap through. A column that is pushed along its axis still buckles, though later than under
a force, as its end is held from the side: so the equilibrium has to be stable among those positions.
"""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from palpate.errors import InputError
from palpate.linalg.minimiser import Product, Solution, capped, minimise_by_newton
from palpate.linalg.multigrid import conjugate_gradients
from palpate.solvers.continuation import steps_to
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.stability import made_stable, settle_from_unstable

BEGIN_TOLERANCE, PART_TOLERANCE = 1e-2, 1e-4
"""Relative residuals of the linear response at which a search begins, and of the equilibrium at a part of the path."""
OVERLAP = 1e-6
"""Inverse condition number of the products of the discs' weights below which two discs count as one."""


class Pushed:
    """The static problem of a ``body`` among the positions in which k discs have given mean displacements.

    weights : (k, n_nodes) of the mean displacement of each disc; rows add up to 1, or to less where nodes of the disc
        are held, whose weights are 0
    Raises InputError for two discs at the same place.
    """

    def __init__(self, body: Equilibrium, weights: sparse.csr_array):
        self._body, self._weights, self._spread = body, weights, weights.T.tocsr()
        gram = (weights @ self._spread).toarray()
        if not (gram.diagonal() > 0.0).all() or np.linalg.cond(gram) > 1.0 / OVERLAP:
            raise InputError("load: two discs are pushed at the same place, or where nothing gives; push one of them.")
        self._inverse = np.linalg.inv(gram)

    def energy(self, x: np.ndarray) -> float:
        """Return the energy [J] of the body under its load."""
        return self._body.energy(x)

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the nodal forces (n_nodes, 3) [N] projected to the subspace, on which they move no disc."""
        return self._projected(self._body.force(x))

    def disc_forces(self, x: np.ndarray) -> np.ndarray:
        """Return the forces (k, 3) [N] that hold the discs at ``x`` (n_nodes, 3) [m]."""
        return -self._inverse @ (self._weights @ self._body.force(x))

    def scale(self, x: np.ndarray) -> float:
        """Return the norm [N] of the nodal forces of the load and of the discs, of a body at ``x`` (n_nodes, 3) [m]."""
        return float(np.linalg.norm(self._body.load + self._spread @ self.disc_forces(x)))

    def means(self, moved: np.ndarray) -> np.ndarray:
        """Return the mean displacements (k, 3) [m] of the discs under displacements (n_nodes, 3) [m]."""
        return self._weights @ moved

    def linearise(self, x: np.ndarray, definite: bool = False) -> tuple[Product, Product]:
        """Return the products with the stiffness at ``x`` and with a preconditioner, both on the subspace."""
        multiply, precondition = self._body.linearise(x, definite)
        return lambda step: self._projected(multiply(step)), self._constrained(precondition)[0]

    def at_rest(self) -> Product:
        """Return the preconditioner of the state at rest on the subspace."""
        return self._constrained(self._body.at_rest())[0]

    def begin(self, x: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """Return positions near ``x`` (n_nodes, 3) [m] in which the discs are displaced by ``moved`` (k, 3) [m].

        They are the response of the body linearised at ``x`` to the missing displacements: Newton's first step.
        """
        multiply, precondition = self._body.linearise(x)
        within, displace = self._constrained(precondition)
        step = displace(moved - self.means(x - self._body.mesh.nodes))
        forces = self.force(x) - self._projected(multiply(step))
        if np.linalg.norm(forces) > 0.0:
            step += conjugate_gradients(lambda a: self._projected(multiply(a)), within, forces, BEGIN_TOLERANCE, 200)[0]
        return x + step

    def _constrained(self, precondition: Product) -> tuple[Product, Callable[[np.ndarray], np.ndarray]]:
        """Return the preconditioner on the subspace, and a map from mean displacements of the discs to those of nodes.

        The map is from (k, 3) [m] to (n_nodes, 3) [m], by forces on the discs to which the preconditioner yields.
        """
        units = np.eye(3 * self._weights.shape[0]).reshape(-1, self._weights.shape[0], 3)
        responses = np.array([precondition(self._spread @ unit) for unit in units])
        stiffness = np.linalg.inv(np.array([self.means(response).ravel() for response in responses]).T)

        def follow(moved: np.ndarray) -> np.ndarray:
            return np.tensordot(stiffness @ moved.ravel(), responses, 1)

        def within(right: np.ndarray) -> np.ndarray:
            step = precondition(right)
            return step - follow(self.means(step))

        return within, follow

    def _projected(self, forces: np.ndarray) -> np.ndarray:
        """Return the part of ``forces`` (n_nodes, 3) that is orthogonal to all forces on whole discs."""
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
    """Find a stable equilibrium with k discs displaced by ``moved`` (k, 3) [m], under ``load`` (n_nodes, 3) [N].

    weights : as of ``Pushed``
    tolerance : of the residual, over the norm of all nodal forces
    iterations : most of Newton's iterations; with a number the result is where the last one ends, stable or not, as of
        ``Equilibrium.approach``; without, ``moved`` and ``load`` are applied in parts where needed, and an equilibrium
        that is not stable is left, as by ``Equilibrium.solve``
    start : positions (n_nodes, 3) [m] to begin at, default rest
    Returns the solution, and the forces (k, 3) [N] on the discs. Raises NotConverged as those do, and InputError for
    two discs at the same place.
    """
    problem, x = Pushed(body, weights), body.mesh.nodes if start is None else start
    if not (moved.any() or load.any()):
        return Solution(body.mesh.nodes.copy(), [0.0], [0.0]), np.zeros_like(moved)
    if iterations is not None:
        body.carry(load)
        begin = problem.begin(x, moved)
        state = capped(problem, begin, problem.scale(begin), tolerance, iterations - 1)
        return state, problem.disc_forces(state.x)
    solution, rest = Solution(x), body.mesh.nodes

    def follow(reached: np.ndarray, part: float, step: float) -> np.ndarray:
        body.carry(part * load)
        guess = problem.begin(rest if part == step < 1.0 else reached, part * moved)
        _settle(problem, guess, tolerance if part == 1.0 else max(tolerance, PART_TOLERANCE), solution)
        return solution.x

    list(steps_to(1.0, 0.0, 1.0, x, follow, "at {:.0%} of the way in steps of {:.1%}".format, stay_short=True))
    solution = made_stable(problem, problem.at_rest, body.mesh.size, solution, lambda x: _slide(problem, x, tolerance))
    return solution, problem.disc_forces(solution.x)


def _slide(problem: Pushed, x: np.ndarray, tolerance: float) -> Solution:
    """Return the equilibrium that the body goes to from ``x`` (n_nodes, 3) [m], beside an unstable one."""
    solution = settle_from_unstable(problem, problem.at_rest(), x, problem.scale(x), tolerance)
    _settle(problem, solution.x, tolerance, solution)
    return solution


SEARCHES = 5


def _settle(problem: Pushed, begin: np.ndarray, tolerance: float, solution: Solution) -> None:
    """Write the equilibrium near ``begin`` (n_nodes, 3) [m] to ``solution``.

    The tolerance is a fraction of the nodal forces of the load and the discs. These may be far larger at ``begin`` than
    at the end, so that the first search is too coarse: it is repeated until they fall by less than half, or SEARCHES
    times.
    """
    solution.x = begin
    for _ in range(SEARCHES):
        scale = problem.scale(solution.x)
        minimise_by_newton(problem, solution.x, scale, tolerance, solution=solution)
        if problem.scale(solution.x) >= 0.5 * scale:
            return
