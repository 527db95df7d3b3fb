"""Relax a body with one constant matrix: projective dynamics to the equilibrium of corotational linear elements.

After Bouaziz and others (2014), seen as Liu, Bouaziz and Kavan (2017) do: projecting each element on its rotation and
solving with the constant matrix Σ (2μ + λ) V G Gᵀ, which is the same for x, y and z, is a descent along that matrix'
inverse times the force. With a memory of the last steps it is theirs, L-BFGS; without, it is the original. The
stiffness of a bed is constant, and the same for x, y and z, too: it is added to the matrix. A node that an instrument
overlaps is projected on the instrument's surface, along the normal, with a weight of its own.

In motion (``make``) a step is their implicit Euler, with the masses in the constant matrix. Rayleigh's damping is added
as the matrix at the step's start. Contact is projected at the end of each step. The papers' law is ‖F − R‖² alone, a
squared distance, which has no Poisson's ratio; the term of λ is in the force here, so that a step converges to the
scene's law.
"""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from palpate.effects import settings
from palpate.effects.bed import BedSprings
from palpate.effects.instrument_penalty import NodeContact
from palpate.effects.linear_elements import LinearElements
from palpate.effects.rayleigh import stage_factors
from palpate.effects.settings import Stepping
from palpate.linalg.minimiser import minimise_by_lbfgs
from palpate.solvers.incremental_potential import IncrementalPotential
from palpate.solvers.pressed_descent import PressedDescent
from palpate.solvers.relaxed_parts import FlatElements, RelaxedParts
from palpate.solvers.system import System

TOLERANCE = 1e-10
"""Of the residual, relative to the load."""


class ProjectiveDynamics:
    """Descent from one projection of ``elements`` to the next, on a ``bed`` or None; ``held`` (n,) bool."""

    def __init__(self, elements: LinearElements, held: np.ndarray, bed: BedSprings | None = None):
        self._effects: list[LinearElements | BedSprings] = [elements] if bed is None else [elements, bed]
        self._held = held
        matrix = laplacian(elements, len(held))
        self._solve = Prefactored(matrix if bed is None else matrix + bed.scalar, held).solve
        self._load = np.zeros((len(held), 3))

    def relax(
        self, x: np.ndarray, load: np.ndarray, iterations: int, memory: int, before: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return positions after so many ``iterations`` from ``x`` (n, 3) [m] under ``load`` (n, 3) [N], and ``x``.

        memory : number of earlier steps by which L-BFGS improves the matrix; 0 for the original method
        before : unused; other methods continue from it, and the memory of this one begins anew
        """
        self._load, self._rest = np.where(self._held[:, None], 0.0, load), x
        tolerance_n = TOLERANCE * float(np.linalg.norm(self._load))
        return minimise_by_lbfgs(self, self._solve, x, tolerance_n, iterations, kept=memory).x, x

    def pressed(self, contact: NodeContact) -> PressedDescent:
        """Return the descent of the body under an instrument, with the penalties of ``contact`` as weights of nodes."""
        return PressedDescent(self._effects, contact, self._held, self._solve, isotropic=True)

    def energy(self, x: np.ndarray) -> float:
        return sum(each.energy(x) for each in self._effects) - float(np.vdot(self._load, x - self._rest))

    def force(self, x: np.ndarray) -> np.ndarray:
        force = self._load.copy()
        for each in self._effects:
            each.add_force(x, None, force)
        force[self._held] = 0.0
        return force


def laplacian(elements: LinearElements | FlatElements, count: int) -> sparse.csc_array:
    """Return Σ (2μ + λ) V G Gᵀ (count, count) [N/m], the stiffness of all projections along each of x, y and z."""
    mu, lam = elements.moduli
    weights = (2.0 * mu + lam) * elements.volumes
    blocks = np.einsum("e,eai,ebi->eab", weights, elements.gradients, elements.gradients)
    couples = elements.tetrahedra
    rows, columns = np.repeat(couples, 4, axis=1).ravel(), np.tile(couples, 4).ravel()
    return sparse.csc_array((blocks.ravel(), (rows, columns)), shape=(count, count))


class Prefactored:
    """The factor of a constant ``matrix`` (n, n) [N/m] between nodes that are not ``held`` (n,) bool."""

    def __init__(self, matrix: sparse.sparray, held: np.ndarray):
        self._free = np.flatnonzero(~held)
        between_free = matrix.tocsc()[self._free][:, self._free]
        self._lu = splu(between_free, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return displacements (n, 3) [m] under ``right`` (n, 3) [N]."""
        step = np.zeros_like(right)
        step[self._free] = self._lu.solve(right[self._free])
        return step


class ProjectiveSteps(RelaxedParts):
    """Time steps of projective dynamics, with the ``iterations`` and the ``memory`` of the scene's settings."""

    def __init__(self, system: System, stepping: Stepping):
        super().__init__(system, "projective_dynamics")
        given, count = stepping.projective_dynamics or settings.ProjectiveDynamics(), len(system.masses)
        self._iterations, self._memory = given.iterations, given.memory
        self._laplacian = laplacian(self.elements, count)
        self._cords = [_isotropic(each.touching(system.particles.nodes, True), count) for each in self.cords]
        self._factored_s = 0.0
        self._factor: Prefactored | None = None

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        system, damping = self.system, self.system.damping(x, explicit=True)
        ahead = x + h * v + h**2 * self.inverse_masses[:, None] * (self.outer(x, v) + self.pushes)
        inertia = system.masses[:, None] / h**2
        problem = IncrementalPotential(
            x,
            ahead,
            ~system.free,
            (self.energy, self.force),
            lambda away: inertia * away,
            None if damping is None else lambda moved: (damping @ moved.ravel()).reshape(moved.shape) / h,
        )
        guess = min((x, ahead), key=problem.energy)
        least = minimise_by_lbfgs(problem, self._prefactored(h).solve, guess, 0.0, self._iterations, kept=self._memory)
        return self.end(x, least.x, v, h)

    def _prefactored(self, h: float) -> Prefactored:
        """Return the factor of the matrix of a step of ``h`` [s]; it is made anew where ``h`` changes."""
        if self._factor is None or h != self._factored_s:
            of_mass, of_stiffness = stage_factors(self.mass_rate, self.stiffness_time, h)
            matrix = of_stiffness * self._laplacian + sparse.diags_array(self.system.masses * of_mass)
            for stiffness in [*self._cords, *([] if self.springs is None else [self.springs.scalar])]:
                matrix = matrix + stiffness
            self._factored_s, self._factor = h, Prefactored(matrix, self.still)
        return self._factor


make = ProjectiveSteps


def _isotropic(touching: tuple[np.ndarray, np.ndarray, np.ndarray], count: int) -> sparse.csc_array:
    """Return the stiffness (count, count) [N/m] of constraints along their own directions, as if it were along all.

    touching : rows, columns and blocks k n nᵀ, whose traces are k
    """
    rows, columns, blocks = touching
    return sparse.csc_array((np.trace(blocks, axis1=1, axis2=2), (rows, columns)), shape=(count, count))
