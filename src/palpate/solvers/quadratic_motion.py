"""Quadratic elements in motion: steps of the implicit midpoint rule, each the minimum of an energy.

The rule is of second order, neither damps nor drives what is linear, and needs no state but positions and velocities
(Hairer, Lubich and Wanner 2006, section II.1.1). Its minima are found by L-BFGS, preconditioned by
multigrid that is kept for as long as it serves.
"""

from collections.abc import Callable, Iterable, Iterator
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.mesh import EDGES, Mesh, TetMesh
from palpate.bodies.particles import lump_masses
from palpate.bodies.refinement import ten_nodes
from palpate.effects.elements import OnePass
from palpate.effects.patch_load import spread
from palpate.effects.push import disc, factor
from palpate.effects.quadratic_elements import QuadraticElements
from palpate.effects.settings import Load, Loads, Rayleigh
from palpate.errors import NotConverged
from palpate.linalg.block_pattern import hold
from palpate.linalg.multigrid import linear_response
from palpate.solvers.equilibrium import Equilibrium, OnSupports
from palpate.solvers.minimiser import Product, minimise_by_lbfgs

MORE_ITERATIONS = 5
"""Iterations by which a step may exceed the first one of its preconditioner before that is made anew."""
MOST_ITERATIONS = 400
"""Iterations of L-BFGS after which a step is not found; 3 to 15 do, and where a body turns far from rest 100."""


def mass_matrix(mesh: TetMesh, element_masses: np.ndarray) -> sparse.csr_array:
    """Return the consistent masses (n, n) [kg] of quadratic elements with ``element_masses`` (n_elements,) [kg].

    n counts nodes and edges of ``mesh``. The integrals of products of two shape functions are those of barycentric
    coordinates in closed form (Zienkiewicz, Taylor and Zhu 2013, section 6.3).
    """
    on_edge = np.array([[corner in edge for edge in EDGES] for corner in range(4)])
    shared = np.array([[len(set(a) & set(b)) for b in EDGES.tolist()] for a in EDGES.tolist()])
    corners, mixed = np.ones((4, 4)) + 5.0 * np.eye(4), np.where(on_edge, -4.0, -6.0)
    whole = np.block([[corners, mixed], [mixed.T, np.array([8.0, 16.0, 32.0])[shared]]]) / 420.0
    ten, n = ten_nodes(mesh), len(mesh.nodes) + len(mesh.edges)
    rows, columns = np.repeat(ten, 10, axis=1).ravel(), np.tile(ten, (1, 10)).ravel()
    return sparse.coo_array((np.outer(element_masses, whole.ravel()).ravel(), (rows, columns)), shape=(n, n)).tocsr()


class Reached(NamedTuple):
    """The end of a step: positions (n, 3) [m], velocities (n, 3) [m/s].

    middle : displacements (n, 3) [m] halfway through the step, which a finer level starts from
    work_j, lost_j : work of the loads and energy that was damped in the step [J]
    convex : whether the search for it met a convex energy
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
    """Steps of the implicit midpoint rule from rest, of n unknown positions (n, k); ``_Step`` says what each minimises.

    What moves gives its ``rest`` (n, k), the ``held`` (n,) bool, the ``masses`` (n, n), the size ``scale_n`` of loads,
    ``load_at``, ``energy`` and ``force`` with the ``load`` in them, ``damping``, and ``_preconditioner``.
    """

    rest: np.ndarray
    held: np.ndarray
    masses: Any
    scale_n: float
    load: np.ndarray

    def load_at(self, t: float) -> np.ndarray:
        """Return the forces (n, k) [N] from outside at ``t`` [s]."""
        raise NotImplementedError

    def energy(self, x: np.ndarray) -> float:
        """Return the elastic energy minus the work of the load [J] at positions ``x`` (n, k)."""
        raise NotImplementedError

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the elastic force plus load (n, k), zero at held nodes."""
        raise NotImplementedError

    def damping(self, x: np.ndarray) -> Product:
        """Return the product of the damping matrix at ``x`` (n, k) with velocities (n, k)."""
        raise NotImplementedError

    def _preconditioner(self, h: float, x: np.ndarray) -> Product:
        """Return what nearly solves for a step of ``h`` [s] at ``x`` (n, k)."""
        raise NotImplementedError

    def steps(
        self, h: float, count: int, tolerance: float, coarser: Iterable[np.ndarray | float] = repeat(0.0)
    ) -> Iterator[Reached]:
        """Yield the ends of ``count`` steps of ``h`` [s] from rest.

        tolerance : of the forces that do not balance, over the largest norm of the loads
        coarser : (n, 3) [m] for each step, its middle as a coarser level has it, interpolated
        A step begins at that middle, or at rest, with what this level has lately added to it, carried on by a parabola.
        Raises NotConverged for a step that is not found.
        """
        rest, first = self.rest, None
        x, v = rest.copy(), np.zeros_like(rest)
        added: list[np.ndarray] = []
        for number, begun in zip(range(count), coarser, strict=False):
            base = rest + np.where(self.held[:, None], 0.0, begun)
            self.load = self.load_at((number + 0.5) * h)
            step = _Step(self, x, v, h)
            if first is None:
                solve = self._preconditioner(h, x)
            way = minimise_by_lbfgs(step, solve, base + _carried_on(added), tolerance * self.scale_n, MOST_ITERATIONS)
            if not way.forces[-1] <= tolerance * self.scale_n:
                raise NotConverged(
                    f"the step at {number * h:.4g} s stopped after {len(way.forces) - 1} iterations at a relative "
                    f"residual of {way.forces[-1] / self.scale_n:.1e}, above the tolerance {tolerance:.0e}",
                    [force / self.scale_n for force in way.forces],
                )
            iterations = len(way.forces) - 1
            first = iterations if first is None else first
            if iterations > first + MORE_ITERATIONS:
                first = None
            added = [*added[-2:], way.x - base]
            velocity = (way.x - x) * (2.0 / h)
            lost = h * float(np.vdot(velocity, step.damping(velocity)))
            x, v = 2.0 * way.x - x, 2.0 * velocity - v
            yield Reached(x, v, way.x - rest, h * float(np.vdot(self.load, velocity)), lost, way.convex)

    def total_energy(self, x: np.ndarray, v: np.ndarray) -> float:
        """Return the elastic and kinetic energy [J] at positions ``x`` (n, k) and velocities ``v``."""
        self.load = np.zeros_like(x)
        return self.energy(x) + 0.5 * float(np.vdot(v, self.masses @ v))


class QuadraticMotion(Equilibrium, Midpoint):
    """A held body of quadratic elements on one level under weight and pushes; arguments and errors of ``Equilibrium``.

    loads : weight and pushes, which are ``push.placed``
    rayleigh : α and β of the damping C = α M + β K⁺(x), K⁺ being the Hessian, clamped to
        positive semidefinite as ``effects.rayleigh`` has it
    masses : (n, n) [kg], consistent, so that the weight is that of the same elements
    """

    def __init__(self, body: Body, level: int, loads: Loads, rayleigh: Rayleigh):
        super().__init__(body, level, order=2)
        coarse, halved, elements = body.levels[level], self.mesh, self._elasticity
        assert isinstance(coarse, TetMesh) and isinstance(halved, TetMesh) and isinstance(elements, QuadraticElements)
        self._tangent = elements.tangent
        density = body.tissue(level).density_kg_m3
        if body.densities is not None:
            density = body.densities[level][coarse.tetrahedra].mean(axis=1)
        self.masses = mass_matrix(coarse, density * coarse.volumes)
        self.lumped = lump_masses(halved, np.repeat(density, 8) * halved.volumes)
        self._alpha, self._beta = rayleigh.mass_1_s, rayleigh.stiffness_s
        self._weight, self._pushes = self._loads(coarse, loads)
        self.rest, self.held = self.mesh.nodes, self._held
        self.scale_n = float(np.linalg.norm(self._weight)) + sum(float(np.linalg.norm(f)) for f, _ in self._pushes)

    def _precondition_by(self, linear: OnSupports) -> None:
        """Keep the linear elements; the first step, whose length counts, asks for their stiffness."""
        self._linear = linear

    def linear_stage(self, tau: float, x: np.ndarray) -> sparse.bsr_array:
        """Return the Hessian of a stage of ``tau`` [s], half a step of the midpoint rule, of linear elements at ``x``.

        It has the stiffness and the damping of these, on the same nodes (n, 3) [m], and lumped masses.
        """
        matrix = self.linear_stiffness(x)
        matrix.data *= 1.0 + self._beta / tau
        mass = (1.0 / tau**2 + self._alpha / tau) * self.lumped
        matrix.data[self._linear.elements.pattern.diagonal] += mass[:, None, None] * np.eye(3)
        return matrix

    def linear_stiffness(self, x: np.ndarray) -> sparse.bsr_array:
        """Return the Hessian (3n, 3n) [N/m] of linear elements at ``x`` (n, 3) [m], clamped."""
        return self._linear.stiffness(x, definite=True)

    def _loads(self, coarse: Mesh, loads: Loads) -> tuple[np.ndarray, list[tuple[np.ndarray, Load]]]:
        """Return the weight (n, 3) [N], and the forces (n, 3) [N] of each push at the factor 1, all on free nodes."""
        free = ~self._held[:, None]
        acceleration = np.array(loads.acceleration_m_s2, dtype=float)
        weight = np.outer(self.masses @ np.ones(len(free)), acceleration) * free
        spreads = ((spread(coarse, disc(p), np.array(p.force_n, dtype=float), 2) * free, p) for p in loads.pushes)
        return weight, list(spreads)

    def load_at(self, t: float) -> np.ndarray:
        """Return the nodal forces (n, 3) [N] from outside at ``t`` [s]."""
        return self._weight + sum(factor(push, t) * forces for forces, push in self._pushes)

    def damping(self, x: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """Return the product of the damping matrix at ``x`` (n, 3) [m] with velocities (n, 3) [m/s], in [N]."""
        clamped = self._tangent(x, True) if self._beta else None

        def multiply(v: np.ndarray) -> np.ndarray:
            force = self._alpha * (self.masses @ v)
            return force if clamped is None else force + self._beta * clamped(v)

        return multiply

    def lacking(
        self, moved: np.ndarray, v: np.ndarray, a: np.ndarray, load: np.ndarray, rayleigh: Rayleigh, residual: float
    ) -> np.ndarray:
        """Return how far (n, 3) [m] the body gives way to what of its forces does not balance.

        moved, v, a : (n, 3) its displacement [m], velocity [m/s] and acceleration [m/s²]; load : (n, 3) [N]
        """
        x, alpha, beta = self.rest + moved, rayleigh.mass_1_s, rayleigh.stiffness_s
        self.load = load
        damped = beta * self._tangent(x, True)(v) if beta else 0.0
        return self.yielding(x, self.force(x) - self.masses @ (a + alpha * v) - damped, residual)

    def yielding(self, x: np.ndarray, force: np.ndarray, residual: float) -> np.ndarray:
        """Return how far (n, 3) [m] a ``force`` (n, 3) [N] moves the body from ``x`` (n, 3) [m], linearised there.

        Its Hessian is clamped; residual : relative, of the answer. NotConverged if none is found.
        """
        free, tangent = ~self.held[:, None], self._tangent(x, True)

        def multiply(u: np.ndarray) -> np.ndarray:
            return np.where(free, tangent(u), u)

        return linear_response(multiply, self._preconditioner(np.inf, x), np.where(free, force, 0.0), residual)

    def _preconditioner(self, h: float, x: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """Return a multigrid cycle for what linear elements on the same nodes, at ``x`` (n, 3) [m], make of a step."""
        assert self._multigrid is not None  # quadratic elements have a level below that of their nodes
        matrix = self.linear_stage(0.5 * h, x)
        hold(matrix.indptr, matrix.indices, matrix.data, self._held)
        self._multigrid.update(matrix)
        return self._multigrid.solve


def _carried_on(past: list[np.ndarray]) -> np.ndarray | float:
    """Return the next of up to three values, on the polynomial through them."""
    if len(past) < 3:
        return 0.0 if not past else past[-1] if len(past) == 1 else 2.0 * past[-1] - past[-2]
    return 3.0 * past[-1] - 3.0 * past[-2] + past[-3]


class _Step(OnePass):
    """½ ‖z − x − h v/2‖²_M · 4/h² + E(z) − f·z + ½ ‖z − x‖²_C · 2/h, whose minimum z is halfway to the step's end.

    There the momentum balances: M (v' − v)/h = f − ∇E(z) − C v̄, v̄ = (v + v')/2 = 2 (z − x)/h. The damping matrix is
    that at x + h v/2, which differs from z by the order of h².
    """

    def __init__(self, motion: Midpoint, x: np.ndarray, v: np.ndarray, h: float):
        super().__init__()
        self._motion, self._x, self._ahead = motion, x, x + 0.5 * h * v
        self._inertia, self._slowness = 4.0 / h**2, 2.0 / h
        self.damping = motion.damping(self._ahead)

    def evaluate(self, z: np.ndarray, force: np.ndarray) -> float:
        motion = self._motion
        away, moved = z - self._ahead, z - self._x
        inertia, drag = self._inertia * (motion.masses @ away), self._slowness * self.damping(moved)
        force += np.where(motion.held[:, None], 0.0, motion.force(z) - inertia - drag)
        return motion.energy(z) + 0.5 * float(np.vdot(away, inertia)) + 0.5 * float(np.vdot(moved, drag))
