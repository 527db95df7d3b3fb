"""What implicit schemes minimise in a step, and its minima by L-BFGS.

A stage of τ from positions x at velocities v ends at the minimum z of

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
"""Iterations by which a stage may exceed the first one of its preconditioner before that is made anew."""
MOST_ITERATIONS = 400
"""Iterations of L-BFGS after which a stage is not found; 3 to 15 do, and where a body turns far from rest 100."""


class IncrementalPotential:
    """The energy that a stage minimises.

    x, ahead : (n, k), where it begins and where inertia alone leads; held : (n,) bool, nodes without forces
    acting : the energy and the forces there are besides, those of loads included, at positions (n, k)
    inertia, drag : the products with M/τ² and C/τ; None where nothing damps
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
        pulled, dragged = self._resistance(z)
        kept = self._energy(z) + 0.5 * float(np.vdot(z - self.ahead, pulled))
        return kept if self._drag is None else kept + 0.5 * float(np.vdot(z - self.x, dragged))

    def force(self, z: np.ndarray) -> np.ndarray:
        """Return minus its gradient (n, k), zero at held nodes."""
        pulled, dragged = self._resistance(z)
        return np.where(self._held, 0.0, self._force(z) - pulled - dragged)

    def _resistance(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
        """Return the forces of inertia and damping, which are kept, as energy and force are asked for at the same z."""
        if self._seen is None or self._seen[0] is not z:
            dragged = 0.0 if self._drag is None else self._drag(z - self.x)
            self._seen = z, self._inertia(z - self.ahead), dragged
        return self._seen[1:]


class Descents:
    """Minima of stages by L-BFGS, with a preconditioner that is kept for as long as it serves."""

    def __init__(self) -> None:
        self._solve: Product | None = None
        self._first: int | None = None

    def minimum(
        self, stage: Smooth, x: np.ndarray, tolerance_n: float, precondition: Callable[[], Product], what: str
    ) -> Descent:
        """Search from ``x`` (n, k) to ‖force‖ ≤ ``tolerance_n`` [N]; NotConverged, saying ``what`` is not found.

        precondition : makes what nearly solves with the Hessian of the stage
        """
        if self._solve is None:
            self._solve, self._first = precondition(), None
        way = minimise_by_lbfgs(stage, self._solve, x, tolerance_n, MOST_ITERATIONS)
        iterations = len(way.forces) - 1
        if not way.forces[-1] <= tolerance_n:
            raise NotConverged(
                f"{what} stopped after {iterations} iterations at a residual of {way.forces[-1]:.1e} N, above "
                f"{tolerance_n:.1e} N",
                way.forces,
            )
        self._first = iterations if self._first is None else self._first
        if iterations > self._first + MORE_ITERATIONS:
            self._solve = None
        return way
