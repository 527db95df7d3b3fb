"""The incremental potential that implicit schemes minimise in each step, and its minima by L-BFGS.

A stage of length τ from positions x at velocities v ends at the minimum z of

    ½ ‖z − x − τ v‖²_M / τ² + E(z) + ½ ‖z − x‖²_C / τ,

where the momentum balances: M ((z − x)/τ − v)/τ = −∇E(z) − C (z − x)/τ (Martin et al. 2011; Gast et al. 2015). A step
of backward Euler is one; one of BDF2 is one of 2h/3 from means of two states; the implicit midpoint rule goes on from
one of h/2 as far again; SDIRK2 has two.
"""

from collections.abc import Callable

import numpy as np

from palpate.errors import NotConverged
from palpate.linalg.minimiser import Descent, Product, Smooth, minimise_by_lbfgs

MORE_ITERATIONS = 5
"""Iterations that a stage may need beyond the first one with its preconditioner, before a new one is made."""
MOST_ITERATIONS = 400
"""Iterations of L-BFGS after which a search fails; 3 to 15 suffice, and 100 where a body turns far from rest."""


class IncrementalPotential:
    """The energy whose minimum is the end of a stage.

    x : (n, k), the positions at its start; ahead : (n, k), x + τ v, where inertia alone leads
    held : (n,) bool, nodes without forces
    acting : the functions from positions (n, k) to the energy E and to its forces, those of loads included
    inertia, drag : the products with M/τ² and C/τ; no drag where nothing damps
    """

    def __init__(
        self,
        x: np.ndarray,
        ahead: np.ndarray,
        held: np.ndarray,
        acting: tuple[Callable[[np.ndarray], float], Callable[[np.ndarray], np.ndarray]],
        inertia: Product,
        drag: Product | None,
    ):
        self.x, self.ahead, self._held = x, ahead, held[:, None]
        (self._energy, self._force), self._inertia, self._drag = acting, inertia, drag
        self._seen: tuple[np.ndarray, np.ndarray, np.ndarray | float] | None = None

    def energy(self, z: np.ndarray) -> float:
        """Return the energy [J] at positions ``z`` (n, k)."""
        inertial, dragged = self._resistance(z)
        energy = self._energy(z) + 0.5 * float(np.vdot(z - self.ahead, inertial))
        return energy if self._drag is None else energy + 0.5 * float(np.vdot(z - self.x, dragged))

    def force(self, z: np.ndarray) -> np.ndarray:
        """Return minus the gradient of the energy (n, k), zero at held nodes."""
        inertial, dragged = self._resistance(z)
        return np.where(self._held, 0.0, self._force(z) - inertial - dragged)

    def _resistance(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
        """Return the forces of inertia and damping at ``z``; those of the last one are stored for the next call."""
        if self._seen is None or self._seen[0] is not z:
            dragged = 0.0 if self._drag is None else self._drag(z - self.x)
            self._seen = z, self._inertia(z - self.ahead), dragged
        return self._seen[1:]


class Descents:
    """Minima of stages by L-BFGS, with one preconditioner for as long as searches do not become slower."""

    def __init__(self) -> None:
        self._solve: Product | None = None
        self._first: int | None = None

    def minimum(
        self, stage: Smooth, x: np.ndarray, tolerance_n: float, precondition: Callable[[], Product], what: str
    ) -> Descent:
        """Return the search from ``x`` (n, k) for the minimum of a ``stage``, to ‖force‖ ≤ ``tolerance_n`` [N].

        precondition : makes the approximate solution with the Hessian of the stage
        what : the name of the stage in the error NotConverged, which is raised where the search ends above tolerance
        """
        if self._solve is None:
            self._solve, self._first = precondition(), None
        descent = minimise_by_lbfgs(stage, self._solve, x, tolerance_n, MOST_ITERATIONS)
        iterations, residual = len(descent.forces) - 1, descent.forces[-1]
        if not residual <= tolerance_n:
            raise NotConverged(
                f"{what} stopped after {iterations} iterations at a residual of {residual:.1e} N, above "
                f"{tolerance_n:.1e} N",
                descent.forces,
            )
        self._first = iterations if self._first is None else self._first
        if iterations > self._first + MORE_ITERATIONS:
            self._solve = None
        return descent
