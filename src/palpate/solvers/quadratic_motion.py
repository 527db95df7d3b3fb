"""Quadratic elements in motion: steps of the implicit midpoint rule, each the minimum of an energy.

The rule is of second order, neither damps nor drives what is linear, and needs no state but positions and velocities
(Hairer, Lubich and Wanner 2006, section II.1.1). Its minima are preconditioned by multigrid.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.mesh import EDGES, TetMesh
from palpate.bodies.particles import lump_masses
from palpate.bodies.refinement import ten_nodes
from palpate.effects.push import Push
from palpate.effects.quadratic_elements import QuadraticElements
from palpate.effects.rayleigh import damping_of, stage_factors
from palpate.effects.settings import Loads, Rayleigh
from palpate.linalg.block_pattern import hold
from palpate.linalg.minimiser import Product
from palpate.linalg.multigrid import linear_response
from palpate.solvers.equilibrium import Equilibrium, OnSupports
from palpate.solvers.incremental_potential import Descents, IncrementalPotential


def mass_matrix(mesh: TetMesh, element_masses: np.ndarray) -> sparse.csr_array:
    """Return the consistent masses (n, n) [kg] of quadratic elements with ``element_masses`` (n_elements,) [kg].

    n counts nodes and edges of ``mesh``. The integrals of products of two shape functions are those of barycentric
    coordinates in closed form (Zienkiewicz, Taylor and Zhu 2013, section 6.3).
    """
    on_edge = np.array([[corner in edge for edge in EDGES] for corner in range(4)])
    shared = np.array([[len(set(a) & set(b)) for b in EDGES.tolist()] for a in EDGES.tolist()])
    corners, mixed = np.ones((4, 4)) + 5.0 * np.eye(4), np.where(on_edge, -4.0, -6.0)
    edges = np.array([8.0, 16.0, 32.0])[shared]  # by the number of corners that two edges have in common
    element = np.block([[corners, mixed], [mixed.T, edges]]) / 420.0
    ten, n = ten_nodes(mesh), len(mesh.nodes) + len(mesh.edges)
    rows, columns = np.repeat(ten, 10, axis=1).ravel(), np.tile(ten, (1, 10)).ravel()
    return sparse.coo_array((np.outer(element_masses, element.ravel()).ravel(), (rows, columns)), shape=(n, n)).tocsr()


class Reached(NamedTuple):
    """The end of a step.

    x, v : positions (n, 3) [m] and velocities (n, 3) [m/s]
    middle : displacements (n, 3) [m] halfway through the step, from which the search of a finer level begins
    work_j, lost_j : work of the loads, and energy that was damped, in the step [J]
    convex : whether the energy was convex where the search went
    forces : (k, 3) [N] of k instruments on the body, mean over the step
    """

    x: np.ndarray
    v: np.ndarray
    middle: np.ndarray
    work_j: float
    lost_j: float
    convex: bool
    forces: np.ndarray = np.zeros((0, 3))


class Midpoint:
    """Steps of the implicit midpoint rule from rest, for n unknown positions (n, k) of a subclass.

    A subclass has these members.
    rest : (n, k); held : (n,) bool; masses : (n, n); scale_n : norm of the largest loads [N]
    load_at : from a time [s] to the forces (n, k) [N] from outside; load : those at the present time
    energy, force : at positions (n, k), of the elements and of ``load``; forces are zero at held nodes
    damping : from positions to the product of the damping matrix there with velocities (n, k)
    _preconditioner : from the length of a step [s] and positions to an approximate solution with the step's Hessian
    """

    rest: np.ndarray
    held: np.ndarray
    masses: Any
    scale_n: float
    load: np.ndarray
    load_at: Callable[[float], np.ndarray]
    energy: Callable[[np.ndarray], float]
    force: Callable[[np.ndarray], np.ndarray]
    damping: Callable[[np.ndarray], Product]
    _preconditioner: Callable[[float, np.ndarray], Product]

    def steps(
        self, h: float, count: int, tolerance: float, coarser: Iterable[np.ndarray | float] = repeat(0.0)
    ) -> Iterator[Reached]:
        """Yield the ends of ``count`` steps of ``h`` [s] from rest.

        tolerance : of the residual forces, over the largest norm of the loads
        coarser : (n, 3) [m] for each step, the displacements in its middle that a coarser level has, interpolated
        The search begins at those displacements, or at rest, and at the difference of this level from them in the last
        steps, extrapolated by a parabola. Raises NotConverged for a step that is not found.
        """
        x, v, descents = self.rest.copy(), np.zeros_like(self.rest), Descents()
        differences: list[np.ndarray] = []
        for index, middle in zip(range(count), coarser, strict=False):
            coarse_guess = self.rest + np.where(self.held[:, None], 0.0, middle)
            self.load = self.load_at((index + 0.5) * h)
            damping = self.damping(x + 0.5 * h * v)
            stage = self.stage((self.energy, self.force), x, v, 0.5 * h, damping)
            descent = descents.minimum(
                stage,
                coarse_guess + _extrapolated(differences),
                tolerance * self.scale_n,
                partial(self._preconditioner, h, x),
                f"the step at {index * h:.4g} s",
            )
            differences = [*differences[-2:], descent.x - coarse_guess]
            velocity = (descent.x - x) * (2.0 / h)
            work_j, lost_j = h * float(np.vdot(self.load, velocity)), h * float(np.vdot(velocity, damping(velocity)))
            x, v = 2.0 * descent.x - x, 2.0 * velocity - v
            yield Reached(x, v, descent.x - self.rest, work_j, lost_j, descent.convex)

    def stage(self, acting: tuple, x: np.ndarray, v: np.ndarray, tau: float, damping: Product) -> IncrementalPotential:
        """Return the incremental potential of a stage of ``tau`` [s] from positions ``x`` at velocities ``v``.

        acting : as of ``IncrementalPotential``
        damping : the product of the damping matrix at x + ``tau`` v, which is that at the end to second order
        """

        def inertia(away: np.ndarray) -> np.ndarray:
            return 1.0 / tau**2 * (self.masses @ away)

        def drag(moved: np.ndarray) -> np.ndarray:
            return 1.0 / tau * damping(moved)

        return IncrementalPotential(x, x + tau * v, self.held, acting, inertia, drag)

    def total_energy(self, x: np.ndarray, v: np.ndarray) -> float:
        """Return the elastic and kinetic energy [J] at positions ``x`` (n, k) and velocities ``v``."""
        self.load = np.zeros_like(x)
        return self.energy(x) + 0.5 * float(np.vdot(v, self.masses @ v))


class QuadraticMotion(Equilibrium, Midpoint):
    """A held body of quadratic elements on one level under weight and pushes; arguments and errors of ``Equilibrium``.

    loads : weight and pushes, whose discs ``push.placed`` has found
    rayleigh : α and β of the damping
    masses : (n, n) [kg], the consistent mass matrix, of which the weight is made, too
    """

    def __init__(self, body: Body, level: int, loads: Loads, rayleigh: Rayleigh):
        super().__init__(body, level, order=2)
        coarse, halved, elements = body.levels[level], self.mesh, self.elements
        assert isinstance(coarse, TetMesh) and isinstance(halved, TetMesh) and isinstance(elements, QuadraticElements)
        self._tangent = elements.tangent
        density = body.tissue(level).density_kg_m3
        if body.densities is not None:
            density = body.densities[level][coarse.tetrahedra].mean(axis=1)
        self.masses = mass_matrix(coarse, density * coarse.volumes)
        self.lumped = lump_masses(halved, np.repeat(density, 8) * halved.volumes)
        self._rates = rayleigh
        self.rest, self.held = self.mesh.nodes, self._held
        self._push = Push(coarse, loads.pushes, 2)
        self._weight = np.outer(self.masses @ np.ones(len(self.held)), np.array(loads.acceleration_m_s2, dtype=float))
        self._weight[self.held] = 0.0
        forces = [self._weight, *(forces[~self.held[nodes]] for nodes, forces in self._push.parts)]
        self.scale_n = sum(float(np.linalg.norm(part)) for part in forces)

    def _precondition_by(self, linear: OnSupports) -> None:
        """Store the ``linear`` elements for ``cycle``, as the preconditioner depends on the length of the steps."""
        self._linear = linear

    def linear_stiffness(self, x: np.ndarray) -> sparse.bsr_array:
        """Return the clamped Hessian (3n, 3n) [N/m] of linear elements on the same nodes at ``x`` (n, 3) [m]."""
        return self._linear.stiffness(x, definite=True)

    def load_at(self, t: float) -> np.ndarray:
        """Return the nodal forces (n, 3) [N] from outside at ``t`` [s]."""
        load = self._weight.copy()
        self._push.at(t)
        self._push.add_force(self.rest, self.rest, load)
        load[self._held] = 0.0
        return load

    def damping(self, x: np.ndarray) -> Product:
        """Return the product of the damping matrix at ``x`` (n, 3) [m] with velocities (n, 3) [m/s], in [N]."""
        return damping_of(self._rates, self.masses, lambda: self._tangent(x, True))

    def unbalanced_response(
        self, moved: np.ndarray, v: np.ndarray, a: np.ndarray, load: np.ndarray, rayleigh: Rayleigh, residual: float
    ) -> np.ndarray:
        """Return the static displacements (n, 3) [m] by the forces of a state that do not balance.

        moved, v, a : (n, 3) the displacements [m], velocities [m/s] and accelerations [m/s²] of the state
        load : (n, 3) [N]; rayleigh : α and β of the damping; residual : as of ``static_response``
        """
        x, self.load = self.rest + moved, load
        damping = damping_of(rayleigh, self.masses, lambda: self._tangent(x, True))
        return self.static_response(x, self.force(x) - self.masses @ a - damping(v), residual)

    def static_response(self, x: np.ndarray, force: np.ndarray, residual: float) -> np.ndarray:
        """Return the static displacements (n, 3) [m] by a ``force`` (n, 3) [N], of the body linearised at ``x`` [m].

        residual : relative, of the linear solution with the clamped Hessian; NotConverged if it is not reached
        """
        free, tangent = ~self.held[:, None], self._tangent(x, True)

        def multiply(u: np.ndarray) -> np.ndarray:
            return np.where(free, tangent(u), u)

        return linear_response(multiply, self._preconditioner(np.inf, x), np.where(free, force, 0.0), residual)

    def _preconditioner(self, h: float, x: np.ndarray) -> Product:
        return self.cycle(0.5 * h, x)

    def cycle(self, tau: float, x: np.ndarray, more: np.ndarray | None = None) -> Product:
        """Return a multigrid cycle with the Hessian of a stage of ``tau`` [s] at ``x`` (n, 3) [m].

        That of linear elements on the same nodes, with lumped masses, and ``more`` (n, 3, 3) [N/m] on its diagonal.
        """
        assert self._multigrid is not None  # quadratic elements have a level below that of their nodes
        matrix, diagonal = self.linear_stiffness(x), self._linear.elements.pattern.diagonal
        of_mass, of_stiffness = stage_factors(self._rates.mass_1_s, self._rates.stiffness_s, tau)
        matrix.data *= of_stiffness
        matrix.data[diagonal] += (of_mass * self.lumped)[:, None, None] * np.eye(3)
        if more is not None:
            matrix.data[diagonal] += more
        hold(matrix.indptr, matrix.indices, matrix.data, self._held)
        self._multigrid.update(matrix)
        return self._multigrid.solve


def _extrapolated(past: list[np.ndarray]) -> np.ndarray | float:
    """Return the next value on the polynomial through up to three equally spaced ones."""
    if len(past) < 3:
        return 0.0 if not past else past[-1] if len(past) == 1 else 2.0 * past[-1] - past[-2]
    return 3.0 * past[-1] - 3.0 * past[-2] + past[-3]
