"""Static equilibrium of a nested elastic body under nodal forces, by Newton's method or by L-BFGS."""

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import Mesh, TetMesh, components
from palpate.effects.bed import BedSprings
from palpate.effects.elements import PLAIN_POISSON, Elements, largest_poisson, warn_of_locking
from palpate.effects.linear_elements import LinearElements
from palpate.effects.quadratic_elements import MeanDilatation, QuadraticElements
from palpate.errors import InputError, NotConverged
from palpate.linalg.block_pattern import BlockPattern, hold, pattern_of, product
from palpate.linalg.minimiser import (
    Product,
    Solution,
    capped,
    descend_or,
    minimise_by_lbfgs,
    minimise_by_newton,
)  # fmt: skip
from palpate.linalg.multigrid import Factor, Multigrid, linear_response
from palpate.solvers.continuation import steps_to
from palpate.solvers.stability import NEUTRAL, made_stable, settle_from_unstable, softest

BUCKLED_SOFTNESS = 0.02
"""Least eigenvalue of the tangent, over the stiffness at rest, below which a search that failed is taken for buckling:
of a bent column it is 1e-4 to 0.011, of bodies that are pressed hard 0.05 and more."""
EASY_POISSON = 0.4
"""Poisson's ratio of the preconditioner of nearly incompressible bodies; between 0.3 and 0.45 it hardly matters."""
PART_TOLERANCE = 1e-4
"""Relative residual of an equilibrium under a part of the load."""


class OnSupports:
    """The stiffness of a body's ``elements`` with that of its ``bed``, or None, and its ``held`` nodes, (n,) bool."""

    def __init__(self, elements: Elements, bed: BedSprings | None, held: np.ndarray):
        self.elements, self._held = elements, held
        self._springs = None if bed is None else elements.pattern.blocks(bed.matrix)

    def stiffness(self, x: np.ndarray, definite: bool) -> sparse.bsr_array:
        """Return the Hessian (3n, 3n) [N/m] at ``x`` (n, 3) [m], clamped if ``definite``.

        Rows and columns of held nodes are those of the identity.
        """
        stiffness = self.elements.stiffness(x, definite)
        if self._springs is not None:
            stiffness.data += self._springs
        hold(stiffness.indptr, stiffness.indices, stiffness.data, self._held)
        return stiffness


class Equilibrium:
    """The static problem on one level of a body, preconditioned by multigrid over the levels below it.

    mesh : whose nodes are the unknowns: of linear elements (``order`` 1) the level's; of quadratic ones (2) the next
        level's, whose nodes are those of the level and its edge midpoints. Elements are straight-sided, with midpoints
        halfway even where the body has them elsewhere. Multigrid for them is that of linear elements at rest. Where
        Poisson's ratio exceeds PLAIN_POISSON anywhere, quadratic elements are of mean dilatation.
    load : (n_nodes, 3) [N], the nodal forces in energy and force; elements : those of the level
    Raises InputError if nothing holds the body or a piece of it, and if quadratic elements lack the next level.
    """

    def __init__(self, body: Body, level: int, order: int = 1):
        finest = level + order - 1
        if finest >= len(body.levels):
            raise InputError(
                f"{body.name}: quadratic elements on level {level} need level {finest}; refine it once more."
            )
        corners = body.levels[finest].tetrahedra
        piece = components(corners[:, [0, 1, 0, 2, 0, 3]].reshape(-1, 2), len(body.levels[finest].nodes))
        if body.bed is None and len(np.unique(piece[body.anchors[finest]])) <= piece.max():
            held_part = "holds a piece of it" if len(body.anchors[finest]) else "is held"
            raise InputError(f"{body.name}: nothing {held_part}, so no equilibrium exists; give it anchors or a bed.")
        patterns = [pattern_of(mesh.tetrahedra, len(mesh.nodes)) for mesh in body.levels[: finest + 1]]
        held = [np.isin(np.arange(pattern.size), nodes) for pattern, nodes in zip(patterns, body.anchors, strict=False)]
        self.mesh = _halved(body, level) if order == 2 else body.levels[level]
        self.elements, self._held = _elements(body, level, order, patterns[-1]), held[-1]
        self._bed = None if body.bed is None else BedSprings(body.levels[level], body.bed, order)
        self._supported = OnSupports(self.elements, self._bed, self._held)
        self.load = np.zeros_like(self.mesh.nodes)
        self._rounding = np.finfo(float).eps * self.mesh.size * float(np.linalg.norm(self.elements.resistance()))
        # without a coarser level, the factor of the state at rest preconditions all states
        self._multigrid = Multigrid(patterns, body.prolongations[:finest], held) if finest else None
        self._renews = self._multigrid is not None and order == 1  # by the stiffness of each state
        if self._multigrid is None:
            self._precondition = Factor(self._supported.stiffness(self.mesh.nodes, definite=False)).solve
        else:
            self._precondition = self._multigrid.solve
            if order == 2:
                linear = LinearElements(self.mesh, preconditioning_tissue(body.tissue(finest)), patterns[-1])
                bed = None if body.bed is None else BedSprings(body.levels[finest], body.bed)
                self._precondition_by(OnSupports(linear, bed, self._held))

    def _precondition_by(self, linear: OnSupports) -> None:
        """Precondition quadratic elements by the stiffness at rest of ``linear`` ones on the same nodes."""
        assert self._multigrid is not None
        self._multigrid.update(linear.stiffness(self.mesh.nodes, definite=False))

    def energy(self, x: np.ndarray) -> float:
        """Return the elastic energy minus the work of the load [J]."""
        energy = self.elements.energy(x) - float(np.vdot(self.load, x - self.mesh.nodes))
        return energy if self._bed is None else energy + self._bed.energy(x)

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the nodal forces (n_nodes, 3) [N] of elements, bed and load, zero at held nodes."""
        force = self.free_force(x)
        force[self._held] = 0.0
        return force

    def free_force(self, x: np.ndarray) -> np.ndarray:
        """Return the nodal forces (n_nodes, 3) [N] of elements, bed and load, also at held nodes."""
        force = self.elements.force(x) + self.load
        if self._bed is not None:
            self._bed.add_force(x, None, force)
        return force

    def carry(self, load: np.ndarray) -> None:
        """Set the ``load`` (n_nodes, 3) [N] in energy and force; none at held nodes."""
        self.load = np.where(self._held[:, None], 0.0, load)

    def correction(self, x: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Return the correction (n_nodes, 3) [m] of ``x`` by one multigrid cycle on its residual under ``load`` [N].

        The cycle is that of the state at rest, or with linear elements of the last state that was linearised.
        """
        self.carry(load)
        return self._precondition(self.force(x))

    def least_det(self, x: np.ndarray) -> float:
        """Return the smallest det F of the elements at ``x`` (n_nodes, 3) [m]; an inverted one's is negative."""
        return self.elements.least_det(x)

    def linearise(self, x: np.ndarray, definite: bool = False) -> tuple[Product, Product]:
        """Return the products with the stiffness at ``x`` and with a preconditioner.

        The preconditioner is a multigrid cycle, for quadratic elements always that of linear ones at rest, or on the
        coarsest level a solve with the stiffness at rest.
        """
        stiffness = self._supported.stiffness(x, definite)
        if self._renews:
            assert self._multigrid is not None
            self._multigrid.update(stiffness)
        return product(stiffness), self._precondition

    def linear_solver(self, tolerance: float = 1e-10) -> Callable[[np.ndarray], np.ndarray]:
        """Return the function from loads (n_nodes, 3) [N] to displacements [m] of the body linearised at rest.

        It also takes k loads at once, (n_nodes, 3, k). NotConverged if the relative residual stays above ``tolerance``.
        """
        multiply, precondition = self.linearise(self.mesh.nodes)

        def respond(load: np.ndarray) -> np.ndarray:
            free_load = load.copy()
            free_load[self._held] = 0.0
            return linear_response(multiply, precondition, free_load, tolerance)

        return respond

    def solve(self, load: np.ndarray, tolerance: float, start: np.ndarray | None = None) -> Solution:
        """Find the stable equilibrium under ``load`` (n_nodes, 3) [N], to ‖residual‖ ≤ ``tolerance`` ‖load‖.

        The search begins at ``start`` (default: rest). If it does not converge under the full load, the load is applied
        in steps, which are halved where needed. If Newton's method stops above the tolerance, but below the effect of
        rounding the positions, as under a small load or for a nearly incompressible body, its result is the best that
        floating point allows, and is returned. An equilibrium that is not stable is left along the direction in which
        the body gives way. Raises NotConverged if none is found, or none that is stable.
        """
        solution = self.settle(load, tolerance, start)
        if not load[~self._held].any():
            return solution
        return made_stable(self, self.at_rest, self.mesh.size, solution, lambda x: self._slide(x, tolerance))

    def balance(self, x: np.ndarray, scale: float, tolerance: float) -> Solution:
        """Find the equilibrium by Newton's method from ``x`` (n, 3) [m], to ‖residual‖ ≤ ``tolerance`` · ``scale`` [N].

        Where it stops below the effect of rounding the positions, its result is the best that floating point allows.
        """
        return minimise_by_newton(self, x, scale, tolerance, rounding_n=self._rounding)

    def settle(self, load: np.ndarray, tolerance: float, start: np.ndarray | None = None) -> Solution:
        """Find an equilibrium as ``solve`` does, stable or not; where the load is applied in parts, from rest."""
        rest, scale, self.load = self.mesh.nodes, self._scale(load), load
        if scale == 0.0:
            return self._unmoved()
        solution = Solution(rest if start is None else start)

        def move(x: np.ndarray, part: float, step: float) -> np.ndarray:
            nonlocal solution
            self.load, is_full = part * load, part == 1.0
            guess, limit = rest if part == step < 1.0 else x, tolerance if is_full else max(tolerance, PART_TOLERANCE)
            try:
                minimise_by_newton(self, guess, scale, limit, solution=solution, rounding_n=self._rounding)
            except NotConverged:
                buckled = self._buckled(solution, tolerance) if step == 1.0 else None
                if buckled is None:
                    raise
                solution = buckled
            return solution.x

        describe = "at {:.0%} of the load in steps of {:.1%}".format
        list(steps_to(1.0, 0.0, 1.0, solution.x, move, describe, stay_short=True))
        return solution

    def softness(self, x: np.ndarray) -> float:
        """Return the least eigenvalue of the tangent at ``x`` (n_nodes, 3) [m], over the stiffness at rest.

        It is that of ``stability.softest``, under the present load.
        """
        return softest(self, self.at_rest(), x, self.mesh.size).value

    def check_stable(self, x: np.ndarray) -> float:
        """Return the ``softness`` at ``x`` (n_nodes, 3) [m]; NotConverged if that is negative, as the body buckles."""
        value = self.softness(x)
        if value < -NEUTRAL:
            raise NotConverged("the equilibrium is not stable: the body buckles", [value])
        return value

    def at_rest(self) -> Product:
        """Return the preconditioner of the state at rest, a positive definite map from forces to displacements."""
        if self._renews:
            assert self._multigrid is not None
            self._multigrid.update(self._supported.stiffness(self.mesh.nodes, definite=False))
        return self._precondition

    def _buckled(self, solution: Solution, tolerance: float) -> Solution | None:
        """Return the equilibrium that a body which buckles goes to; None if it does not buckle, or none is found.

        solution : where Newton's method has stopped
        """
        if not (np.isfinite(solution.x).all() and self.least_det(solution.x) > 0.0):
            return None
        if self.softness(solution.x) > BUCKLED_SOFTNESS:
            return None
        try:
            return self._slide(solution.x, tolerance).after(solution)
        except NotConverged:
            return None

    def _slide(self, x: np.ndarray, tolerance: float) -> Solution:
        return settle_from_unstable(self, self.at_rest(), x, self._scale(self.load), tolerance)

    def _scale(self, load: np.ndarray) -> float:
        return float(np.linalg.norm(load[~self._held]))

    def _unmoved(self) -> Solution:
        return Solution(self.mesh.nodes.copy(), [0.0], [0.0])

    def approach(
        self, load: np.ndarray, tolerance: float, iterations: int, start: np.ndarray | None = None
    ) -> Solution:
        """Return the state after at most so many ``iterations`` under the full ``load`` (n_nodes, 3) [N].

        start : positions (n_nodes, 3) [m] to begin at, with the held nodes at rest; default: rest
        The result need not be an equilibrium: the last residual of its history measures the distance from one. Raises
        NotConverged if an iteration fails, but not because there are too few of them.
        """
        scale, self.load = self._scale(load), load
        if scale == 0.0:
            return self._unmoved()
        return self._capped(self.mesh.nodes.copy() if start is None else start, scale, tolerance, iterations)

    def _capped(self, start: np.ndarray, scale: float, tolerance: float, iterations: int) -> Solution:
        return capped(self, start, scale, tolerance, iterations)


def _elements(body: Body, level: int, order: int, pattern: BlockPattern) -> Elements:
    """Return the elements of a level, quadratic ones of mean dilatation where plain ones would lock."""
    tissue, mesh = body.tissue(level), body.levels[level]
    poisson = largest_poisson(tissue)
    if order == 1:
        warn_of_locking(body.name, poisson)
        return LinearElements(mesh, tissue, pattern)
    return MeanDilatation(mesh, tissue) if poisson > PLAIN_POISSON else QuadraticElements(mesh, tissue)


def preconditioning_tissue(tissue: Tissue) -> Tissue:
    """Return the tissue of the linear elements that precondition quadratic ones at rest, where all laws are the same.

    Where linear elements lock they are far stiffer than those of mean dilatation. So Poisson's ratio is then at most
    EASY_POISSON, at the same shear modulus; at 0.4999 conjugate gradients take 330 steps instead of 430.
    """
    locks, materials = largest_poisson(tissue) > PLAIN_POISSON, []
    for material in tissue.materials:
        poisson = min(material.poisson, EASY_POISSON) if locks else material.poisson
        young = 2.0 * material.shear_pa * (1.0 + poisson) if locks else material.young_pa
        materials.append(Material(young, poisson, material.density_kg_m3))
    return Tissue(materials, tissue.region)


def _halved(body: Body, level: int) -> Mesh:
    """Return the next level's mesh with every new node halfway between two of ``level``."""
    finer = body.levels[level + 1]
    nodes = body.prolongations[level] @ body.levels[level].nodes
    return finer if np.array_equal(nodes, finer.nodes) else TetMesh(nodes, finer.tetrahedra)


class FastEquilibrium(Equilibrium):
    """Equilibrium of quadratic elements by L-BFGS: an iteration is one pass over them and one multigrid cycle at rest.

    An iteration of Newton's method assembles a stiffness and needs as many cycles as L-BFGS needs in all. In a
    ``Solution`` each iteration of L-BFGS counts as one product.
    """

    def settle(
        self,
        load: np.ndarray,
        tolerance: float,
        start: np.ndarray | None = None,
        otherwise: Callable[[np.ndarray], Solution] | None = None,
    ) -> Solution:
        """Find an equilibrium by L-BFGS, stable or not, and where that is slow by Newton's method.

        otherwise : what is done instead of Newton's method, as ``descend_or`` has it
        """
        scale, self.load = self._scale(load), load
        if scale == 0.0:
            return self._unmoved()
        begin = self.mesh.nodes if start is None else start
        newton = otherwise or partial(super().settle, load, tolerance)
        return descend_or(self, self.at_rest(), begin, scale, tolerance, newton)

    def _capped(self, start: np.ndarray, scale: float, tolerance: float, iterations: int) -> Solution:
        """Do so many iterations of L-BFGS, none of which raises the energy."""
        return minimise_by_lbfgs(self, self.at_rest(), start, tolerance * scale, iterations).solution(scale)


class Unbuckled(FastEquilibrium):
    """Equilibrium of a body that must not buckle: which side it would give way to depends on its mesh."""

    def solve(self, load: np.ndarray, tolerance: float, start: np.ndarray | None = None) -> Solution:
        """Find the equilibrium as ``FastEquilibrium`` does, and raise NotConverged where it is not stable."""
        solution = self.settle(load, tolerance, start)
        self.check_stable(solution.x)
        return solution
