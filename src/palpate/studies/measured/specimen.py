"""A model of the body that was measured: its rest, its masses, and its equilibrium under any load."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.mesh import Mesh
from palpate.bodies.particles import particles_of
from palpate.effects.elements import locking_is_measured
from palpate.effects.held import Held
from palpate.effects.springs import make as make_springs
from palpate.errors import InputError
from palpate.linalg.block_pattern import product
from palpate.linalg.multigrid import Factor
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.newton import Product, minimise
from palpate.solvers.system import System
from palpate.studies.measured.carried import Carried
from palpate.studies.measured.experiment import Marker, Weight
from palpate.studies.measured.loads import hung_masses, nodal_loads
from palpate.studies.measured.masses import mass_matrix

TOLERANCE = 1e-5
"""Relative residual of equilibria, far below the differences between repeats."""


class Specimen(Protocol):
    """A model of a body: ``rest`` (n, 3) [m], what is ``held`` (k,), ``masses`` (n, n) [kg].

    mesh, order : its surface has linear or quadratic shape functions on this mesh
    """

    rest: np.ndarray
    held: np.ndarray
    masses: sparse.csr_array
    mesh: Mesh
    order: int

    def settle(self, load: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        """Return the equilibrium (n, 3) [m] under ``load`` (n, 3) [N], sought from ``start``; NotConverged if none."""
        raise NotImplementedError

    def linearise(self, x: np.ndarray) -> tuple[Product, Product]:
        """Return the products with the stiffness at ``x`` [N/m] and with a preconditioner for it."""
        raise NotImplementedError


class FemSpecimen:
    """Finite elements of ``order`` on a level of ``body``."""

    def __init__(self, body: Body, level: int, order: int):
        with locking_is_measured():
            self._equilibrium = Equilibrium(body, level, order)
        self.rest, self.held = self._equilibrium.mesh.nodes, body.anchors[level + order - 1]
        self.mesh: Mesh = body.levels[level]
        self.order = order
        self.masses = mass_matrix(self.mesh, body.tissue(level).density_kg_m3, order)

    def settle(self, load: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        return self._equilibrium.solve(load, TOLERANCE, start).x

    def linearise(self, x: np.ndarray) -> tuple[Product, Product]:
        return self._equilibrium.linearise(x)


class SpringSpecimen:
    """Springs on the edges of a level's tetrahedra, of the body's modulus (paper 2, eq. 5), and lumped masses."""

    def __init__(self, body: Body, level: int):
        particles = particles_of(body, level, surface=False)
        if not len(particles.held):
            raise InputError(f"{body.name}: nothing is held, so springs have no equilibrium; give it anchors.")
        self.rest, self.held = particles.nodes, particles.held
        self.mesh: Mesh = body.levels[level]
        self.order = 1
        self.masses = sparse.diags_array(particles.masses).tocsr()
        self._system = System(particles, {"springs": make_springs(particles, {}), "held": Held(particles.held)})
        self._factor = Factor(self._stiffness(self.rest, definite=True))
        self._load = np.zeros_like(self.rest)

    def settle(self, load: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        self._load = np.where(self._system.free[:, None], load, 0.0)
        scale = float(np.linalg.norm(self._load))
        return minimise(self, self.rest if start is None else start, scale, TOLERANCE).x

    def energy(self, x: np.ndarray) -> float:
        """Return the energy of the springs minus the work of the load [J]."""
        return self._system.energy(x) - float(np.vdot(self._load, x - self.rest))

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the forces of springs and load (n, 3) [N], zero at held nodes."""
        return self._system.potential_force(x) + self._load

    def linearise(self, x: np.ndarray, definite: bool = False) -> tuple[Product, Product]:
        return product(self._stiffness(x, definite)), self._factor.solve

    def _stiffness(self, x: np.ndarray, definite: bool) -> sparse.bsr_array:
        stiffness = self._system.stiffness(x, definite)
        assert stiffness is not None
        self._system.hold(stiffness)
        return stiffness


class Bench:
    """A specimen with its markers, under gravity and loads."""

    def __init__(self, specimen: Specimen, markers: Sequence[Marker], gravity_m_s2: float):
        self.specimen, self._gravity = specimen, gravity_m_s2
        self._carried = Carried(specimen.mesh, np.array([marker.at_m for marker in markers]), specimen.order)
        self._at_rest = self._carried.of(specimen.rest)
        self._own = specimen.masses.sum(axis=1)

    def load(self, weights: Sequence[Weight], down: np.ndarray) -> np.ndarray:
        """Return the forces (n, 3) [N] of gravity along ``down`` (3,) and of ``weights``."""
        own = self._gravity * np.outer(self._own, down)
        return own + nodal_loads(self.specimen.mesh, weights, down, self.specimen.order)

    def masses(self, weights: Sequence[Weight]) -> sparse.csr_array:
        """Return the mass matrix (n, n) [kg] of the body and of what hangs on it."""
        hung = hung_masses(self.specimen.mesh, weights, self._gravity, self.specimen.order)
        return (self.specimen.masses + hung).tocsr()

    def moves(self, x: np.ndarray) -> np.ndarray:
        """Return the markers' moves (m, 3) [m] from rest to where the nodes are at ``x`` (n, 3) [m]."""
        return self._carried.of(x) - self._at_rest
