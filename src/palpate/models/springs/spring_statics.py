"""Find the equilibrium of a spring network on one level of a body."""

import numpy as np
from scipy import sparse

from palpate.benchmark.model import Case, refuse_bed, refuse_regions
from palpate.bodies.particles import particles_of
from palpate.effects.held import Held
from palpate.effects.springs import Springs
from palpate.effects.volume_force import Volume
from palpate.errors import InputError, NotConverged
from palpate.linalg.conjugate_gradients import conjugate_gradients
from palpate.linalg.multigrid import Factor
from palpate.models.fem_statics import ContactShares, to_surface
from palpate.models.springs.calibration.spring_model import spring_model
from palpate.models.springs.calibration.spring_motion import stiffnesses
from palpate.solvers.lbfgs import descend
from palpate.solvers.system import System

TOLERANCE, REACHED, MOST = 1e-6, 1e-3, 300
"""Residuals relative to the load at which a search ends and which it must reach; and after how many iterations."""


class Network:
    """Springs on the edges of a level's tetrahedra, and paper 2's volume force if it has a stiffness.

    rest : (n, 3) [m]; model : all of the springs but their stiffness, which ``stiffen`` gives
    up : (n_surface, n), from nodes to the fine surface
    Raises InputError for a body that nothing holds.
    """

    def __init__(self, case: Case, level: int):
        self.particles = particles_of(case.body, level, surface=False)
        refuse_bed(case, "springs")
        refuse_regions(case, "springs")
        if not len(self.particles.held):
            raise InputError(f"{case.body.name}: nothing is held, so springs have no equilibrium; give it anchors.")
        self.model, self.rest = spring_model(self.particles), self.particles.nodes
        self.up = to_surface(case.body, level)
        self._shares = ContactShares(case, level)
        self._load = np.zeros_like(self.rest)

    def stiffen(self, young_pa: np.ndarray, volume_n_m: float) -> None:
        """Give nodes their moduli (n,) [Pa] (paper 2, eq. 5), and the volume force its stiffness [N/m]."""
        springs = Springs(self.model.pairs, stiffnesses(self.model, young_pa), self.model.rest_m)
        effects = {"springs": springs, "held": Held(self.particles.held)}
        if volume_n_m > 0.0:
            effects["volume"] = Volume(self.particles, volume_n_m)
        self._system = System(self.particles, effects)
        self._factor = Factor(self._stiffness(self.rest))

    def press(self, contact: int, force: np.ndarray) -> None:
        """Load it with ``force`` (3,) [N] at coarse node ``contact``; InputError if that cannot be pressed."""
        nodes, shares = self._shares.of(contact)
        self._load = np.zeros_like(self.rest)
        self._load[nodes] = np.outer(shares, force)
        self._load[self.particles.held] = 0.0

    def energy(self, x: np.ndarray) -> float:
        """Return the energy of springs and volume minus the work of the load [J]."""
        return self._system.energy(x) - float(np.vdot(self._load, x - self.rest))

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return their forces and the load (n, 3) [N], zero at held nodes."""
        return self._system.potential_force(x) + self._load

    def approach(self, iterations: int, start: np.ndarray | None = None) -> np.ndarray:
        """Return positions (n, 3) [m] after so many quasi-Newton iterations; from rest the first is the linear answer.

        Raises NotConverged if not even the first lowers the energy.
        """
        enough, start = TOLERANCE * float(np.linalg.norm(self._load)), self.rest if start is None else start
        x = descend(self, self._factor.solve, start, enough, iterations).x
        if x is start and not np.linalg.norm(self.force(x)) <= enough:
            raise NotConverged(f"{self.particles.name}: springs find no way to give in; check the force", [])
        return x

    def settle(self, start: np.ndarray) -> np.ndarray:
        """Return positions (n, 3) [m] at rest under the load; NotConverged if none are found."""
        x = self.approach(MOST, start)
        left = float(np.linalg.norm(self.force(x)) / max(float(np.linalg.norm(self._load)), 1e-300))
        if not left <= REACHED:
            raise NotConverged(f"{self.particles.name}: springs still move after {MOST} iterations", [left])
        return x

    def adjoint(self, x: np.ndarray, by_x: np.ndarray) -> np.ndarray:
        """Apply the inverse of the stiffness at ``x`` to ``by_x`` (n, 3): the adjoint of the equilibrium.

        Where the stiffness is not positive definite, this returns what conjugate gradients reach.
        """
        stiffness = self._stiffness(x)
        right = by_x.copy()
        right[self.particles.held] = 0.0

        def product(p: np.ndarray) -> np.ndarray:
            return (stiffness @ p.ravel()).reshape(p.shape)

        return conjugate_gradients(product, self._factor.solve, right, 1e-3, 200)[0]

    def _stiffness(self, x: np.ndarray) -> sparse.bsr_array:
        stiffness = self._system.stiffness(x, definite=False)
        self._system.hold(stiffness)
        return stiffness
