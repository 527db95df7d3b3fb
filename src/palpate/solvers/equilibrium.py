"""Static equilibrium of a nested elastic body under nodal forces."""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.effects.corotational import Corotational
from palpate.errors import InputError, NotConverged
from palpate.linalg.block_pattern import hold, pattern_of
from palpate.linalg.conjugate_gradients import conjugate_gradients
from palpate.linalg.factor import Factor
from palpate.linalg.multigrid import Multigrid
from palpate.solvers.newton import Product, Solution, minimise


class Equilibrium:
    """The static problem on one level of a body, preconditioned by multigrid over the levels below it."""

    def __init__(self, body: Body, level: int):
        self.mesh = body.levels[level]
        if not len(body.anchors[level]):
            raise InputError(f"{body.name}: nothing is held, so no equilibrium exists; give it anchors.")
        patterns = [pattern_of(m.tetrahedra, len(m.nodes)) for m in body.levels[: level + 1]]
        held = [_indicator(a, len(m.nodes)) for a, m in zip(body.anchors, body.levels[: level + 1], strict=False)]
        self._elasticity = Corotational(self.mesh, body.material, patterns[-1])
        self._held = held[-1]
        self._load = np.zeros_like(self.mesh.nodes)
        self._rounding = np.finfo(float).eps * self.mesh.size * float(np.linalg.norm(self._elasticity.resistance()))
        # without a coarser level, the factor of the rest state preconditions every state
        self._preconditioner: Multigrid | Factor = (
            Multigrid(patterns, body.prolongations[:level], held)
            if level
            else Factor(self._stiffness(self.mesh.nodes, definite=False))
        )

    def energy(self, x: np.ndarray) -> float:
        """Return the elastic energy minus the work of the load [J]."""
        return self._elasticity.energy(x) - float(np.vdot(self._load, x - self.mesh.nodes))

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the elastic force plus load (n_nodes, 3) [N], zero at held nodes."""
        force = self._elasticity.force(x) + self._load
        force[self._held] = 0.0
        return force

    def linearise(self, x: np.ndarray, definite: bool = False) -> tuple[Product, Product]:
        """Return the products with the stiffness at ``x`` and with a preconditioner.

        The preconditioner is a multigrid cycle, or on the coarsest level a solve with the stiffness at rest.
        """
        stiffness = self._stiffness(x, definite)
        if isinstance(self._preconditioner, Multigrid):
            self._preconditioner.update(stiffness)
        return lambda p: (stiffness @ p.ravel()).reshape(p.shape), self._preconditioner.solve

    def _stiffness(self, x: np.ndarray, definite: bool) -> sparse.bsr_array:
        stiffness = self._elasticity.stiffness(x, definite)
        hold(stiffness.indptr, stiffness.indices, stiffness.data, self._held)
        return stiffness

    def linear_solver(self, tolerance: float = 1e-10) -> Callable[[np.ndarray], np.ndarray]:
        """Return the function from loads (n_nodes, 3) [N] to displacements [m] of the body linearised at rest.

        It raises NotConverged if conjugate gradients do not reach ``tolerance``.
        """
        multiply, precondition = self.linearise(self.mesh.nodes)

        def respond(load: np.ndarray) -> np.ndarray:
            right = np.where(self._held[:, None], 0.0, load)
            if not right.any():
                return right
            response, products, _ = conjugate_gradients(multiply, precondition, right, tolerance, 1000)
            left = float(np.linalg.norm(right - multiply(response)) / np.linalg.norm(right))
            if not left <= 10 * tolerance:
                raise NotConverged(
                    f"the linear response stopped after {products} products at a relative residual of {left:.1e}, "
                    f"above the tolerance {tolerance:.0e}",
                    [left],
                )
            return response

        return respond

    def solve(self, load: np.ndarray, tolerance: float, start: np.ndarray | None = None) -> Solution:
        """Find the equilibrium under ``load`` (n_nodes, 3) [N], to ‖residual‖ ≤ ``tolerance`` ‖load‖ on free nodes.

        The search begins at ``start`` (default: rest). If it does not converge under the full load, the load is applied
        in steps, which are halved as needed. Raises NotConverged once a step is below 1/64. If Newton's method stops
        above the tolerance, but below the effect of rounding the positions, as happens under a small load or for a
        nearly incompressible body, its result is the best that floating point allows, and is returned.
        """
        rest = self.mesh.nodes
        scale = float(np.linalg.norm(load[~self._held]))
        if scale == 0.0:
            return Solution(rest.copy(), [0.0], [0.0])
        x = rest if start is None else start
        reached, step, solution = 0.0, 1.0, Solution(x)
        while True:
            self._load = (reached + step) * load
            last = reached + step >= 1.0
            try:
                minimise(self, x, scale, tolerance if last else max(tolerance, 1e-4), solution=solution)
            except NotConverged as failure:
                if not solution.history[-1] * scale <= self._rounding:
                    step *= 0.5
                    x = rest if reached == 0.0 else x
                    if step < 1 / 64:
                        message = f"{failure}, at {reached + 2 * step:.0%} of the load in steps of {2 * step:.1%}"
                        raise NotConverged(message, solution.history) from failure
                    continue
            x, reached = solution.x, reached + step
            if last:
                return solution

    def approach(self, load: np.ndarray, tolerance: float, iterations: int) -> Solution:
        """Do at most ``iterations`` Newton iterations from rest under the full ``load`` (n_nodes, 3) [N].

        The result need not be an equilibrium; the last residual of its history measures the distance from one. Raises
        NotConverged if an iteration fails, but not because there are too few of them.
        """
        solution = Solution(self.mesh.nodes.copy(), [0.0], [0.0])
        scale = float(np.linalg.norm(load[~self._held]))
        if scale == 0.0:
            return solution
        solution.history, solution.seconds, self._load = [], [], load
        try:
            return minimise(self, solution.x, scale, tolerance, iterations, solution)
        except NotConverged:
            if solution.iterations < iterations or not np.isfinite(solution.history[-1]):
                raise
            return solution


def _indicator(nodes: np.ndarray, count: int) -> np.ndarray:
    indicator = np.zeros(count, dtype=bool)
    indicator[nodes] = True
    return indicator
