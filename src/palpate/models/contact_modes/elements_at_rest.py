"""The finite elements that a model is reduced from: one level of a body, linearised at rest, and loaded."""

import numpy as np

from palpate.bodies.body import Body
from palpate.effects.elements import PLAIN_POISSON, largest_poisson
from palpate.effects.quadratic_elements import SLOPES
from palpate.errors import NotConverged
from palpate.linalg.minimiser import Descent, minimise_by_lbfgs
from palpate.linalg.multigrid import linear_response
from palpate.solvers.equilibrium import Equilibrium


class ElementsAtRest:
    """Quadratic elements on a level of ``body``, which has the next one: m elements between n nodes.

    size : of the body [m]; rest : (n, 3) [m]; couples : (m, 10) the nodes of each element; volumes : (m,) [m³]
    moduli : μ and λ of each element, two (m,) [Pa]; law : functions of the law, as kernels take them
    multiply, precondition : the stiffness at rest and a multigrid cycle, functions of (n, 3) or (n, 3, k)
    Raises NotConverged for a body whose elements resist volume on average, so that a point has no energy of its own.
    """

    def __init__(self, body: Body, level: int):
        if largest_poisson(body.tissue(level)) > PLAIN_POISSON:
            message = f"Poisson's ratio of {body.name} is above {PLAIN_POISSON}: contact modes have no mean dilatation"
            raise NotConverged(message, [float("nan")])
        self.size, self.level = body.fine.size, level
        self._equilibrium = Equilibrium(body, level, order=2)
        self.held = body.anchors[level + 1]
        self.rest = self._equilibrium.mesh.nodes
        elements = self._equilibrium.elements
        self.couples, self._gradients, self.volumes = elements.couples, elements.gradients, elements.volumes
        self.moduli, self.law = elements.moduli, elements.law
        self.multiply, self.precondition = self._equilibrium.linearise(self.rest)

    @property
    def points(self) -> int:
        """The number of integration points of an element."""
        return len(SLOPES)

    def gradients_at(self, elements: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return gradients (k, a, 3) [1/m] of shape functions at ``points`` (k,), one in each of ``elements`` (k,)."""
        return np.matmul(SLOPES[points], self._gradients[elements, 1:])

    def mean_gradients(self, elements: np.ndarray) -> np.ndarray:
        """Return the means of these gradients over the points of each of k ``elements``, (k, a, 3) [1/m]."""
        return np.matmul(SLOPES.mean(axis=0), self._gradients[elements, 1:])

    def nodal(self, nodes: np.ndarray, shares: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Spread ``forces`` (3, ...) [N] over ``nodes`` (k,) by ``shares`` (k,): (n, 3, ...), zero at held nodes."""
        load = np.zeros((len(self.rest), *forces.shape))
        load[nodes] = np.multiply.outer(shares, forces)
        load[self.held] = 0.0
        return load

    def solve(self, loads: np.ndarray, tolerance: float) -> np.ndarray:
        """Return linear responses (n, 3, k) [m] to ``loads`` (n, 3, k) [N]; errors as of ``linear_response``."""
        right = loads.copy()
        right[self.held] = 0.0
        return linear_response(self.multiply, self.precondition, right, tolerance)

    def force(self, moved: np.ndarray, load: np.ndarray | float = 0.0) -> np.ndarray:
        """Return the elastic force under displacements (n, 3) [m] plus ``load``, (n, 3) [N], zero at held nodes."""
        self._equilibrium.carry(np.broadcast_to(load, self.rest.shape))
        return self._equilibrium.force(self.rest + moved)

    def residual(self, moved: np.ndarray, load: np.ndarray) -> float:
        """Return what is left of ``load`` (n, 3) [N] under displacements (n, 3) [m], over its size."""
        return float(np.linalg.norm(self.force(moved, load)) / np.linalg.norm(load))

    def least_det(self, moved: np.ndarray) -> float:
        """Return the smallest det F of all points under displacements (n, 3) [m]."""
        return self._equilibrium.least_det(self.rest + moved)

    def settle(
        self, load: np.ndarray, moved: np.ndarray, iterations: int, tolerance: float = 0.0, least: int = 0
    ) -> np.ndarray:
        """Return displacements (n, 3) [m] under ``load`` (n, 3) [N], after L-BFGS steps from ``moved`` (n, 3) [m].

        At most ``iterations`` steps are made, and at least ``least``; they end where the residual is below
        ``tolerance`` times the load.
        """
        tolerance_n = tolerance * float(np.linalg.norm(load))

        def callback(descent: Descent) -> bool:
            return len(descent.forces) <= least or descent.forces[-1] > tolerance_n

        problem, start = self._equilibrium, self.rest + moved
        problem.carry(load)
        return minimise_by_lbfgs(problem, self.precondition, start, 0.0, iterations, callback).x - self.rest
