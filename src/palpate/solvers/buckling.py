"""The ratio of a load to the one at which the body buckles, linearised at rest, for presses at any place.

In the softest mode shapes φ of the body at rest, scaled so that the stiffness is the identity, a load f changes the
stiffness by −f · sⱼₖ, the work that it does on their second-order displacements sⱼₖ = −K⁻¹ ∂³E[φⱼ, φₖ], the static
modal derivatives (Idelsohn and Cardona 1985). A column that bends becomes shorter, so that a load on its end does work
and helps to bend it. The body buckles where an eigenvalue of that work is 1.
"""

import warnings
from collections.abc import Iterable
from math import sqrt

import numpy as np
from scipy.sparse.linalg import LinearOperator, lobpcg

from palpate.bodies.body import Body
from palpate.bodies.refinement import with_midpoints
from palpate.effects.patch_load import patch_at, patch_shares
from palpate.linalg.minimiser import Product
from palpate.linalg.multigrid import linear_response
from palpate.solvers.equilibrium import Equilibrium

SHAPES = 6
"""Number of mode shapes: of a column two pairs that bend, one that twists and one that shortens."""
SHAPE_TOLERANCE, SHAPE_ITERATIONS, SPARE = 1e-3, 40, 3
"""Relative residual of the shapes, most iterations for them, and number of further ones that need not converge."""
STRETCH = 0.1
"""Third derivative of the energy among shapes that do not stretch each other, over the largest of all, at most."""
DIFFERENCE = 0.005
"""Largest displacement in the finite differences, over the body's size."""
RESIDUAL = 1e-3
"""Relative residual of the second-order displacements."""


class Buckling:
    """The second-order displacements of the softest shapes of ``body``, in quadratic elements on its coarsest level.

    radius_m : of the discs of pressure [m]
    """

    def __init__(self, body: Body, radius_m: float):
        refined = body if len(body.levels) > 1 else with_midpoints(body, 0)
        problem = Equilibrium(refined, 0, order=2)
        self._body, self._radius_m = body, radius_m
        self._works: dict[int, tuple[np.ndarray, float]] = {}
        multiply, precondition = problem.linearise(problem.mesh.nodes)
        shapes = _softest(multiply, precondition, len(problem.mesh.nodes), refined.anchors[1])
        j, k = np.triu_indices(shapes.shape[2])
        forces = _second_order_forces(problem, shapes, j, k)
        bending = _inextensible(shapes, forces, j, k)
        both_bend = np.isin(j, bending) & np.isin(k, bending)
        j, k = np.searchsorted(bending, j[both_bend]), np.searchsorted(bending, k[both_bend])
        responses = linear_response(multiply, precondition, forces[:, :, both_bend], RESIDUAL)
        self._second_order = np.empty((*shapes.shape[:2], len(bending), len(bending)))
        self._second_order[:, :, j, k] = self._second_order[:, :, k, j] = responses

    def share(self, presses: Iterable[tuple[int, np.ndarray]], enough: float = 0.0) -> float:
        """Return the ratio of a load to the one at which the body buckles, 0 if no load in that direction does it.

        presses : fine surface nodes, and the force (3,) [N] on the disc around each
        enough : a ratio that matters; where a quick upper bound is no larger, that bound is returned instead
        """
        works = [(force, *self._unit_work(node)) for node, force in presses]
        bound = sum(sqrt(np.dot(force, force)) * norm for force, _, norm in works)
        if bound <= enough:
            return bound
        count = self._second_order.shape[2]
        work = sum(force @ unit for force, unit, _ in works).reshape(count, count)
        return max(float(np.linalg.eigvalsh(work)[-1]), 0.0)

    def _unit_work(self, node: int) -> tuple[np.ndarray, float]:
        """Return the work (3, r²) of unit forces on the disc around a node, and its largest norm [1/N].

        The work is that on the second-order displacements of r shapes; no eigenvalue exceeds the norm.
        """
        if node not in self._works:
            nodes, shares = patch_shares(self._body.coarse, patch_at(self._body, node, self._radius_m), 2)
            work = np.tensordot(shares, self._second_order[nodes], 1).reshape(3, -1)
            self._works[node] = work, float(np.linalg.norm(work, 2))
        return self._works[node]


def _softest(multiply: Product, precondition: Product, count: int, held: np.ndarray) -> np.ndarray:
    """Return the softest mode shapes (n, 3, r) of the stiffness, scaled so that it is the identity among them.

    multiply, precondition : the products with the stiffness and its preconditioner, of ``count`` nodes
    held : the nodes that do not move
    """
    movable = np.ones((count, 3))
    movable[held] = 0.0
    width = min(SHAPES + SPARE, int(movable.sum()) // 5)

    def as_matrix(apply: Product) -> LinearOperator:
        def product(x: np.ndarray) -> np.ndarray:
            return apply(np.ascontiguousarray(x.reshape(count, 3, -1))).reshape(x.shape)

        return LinearOperator((3 * count, 3 * count), product, matmat=product, dtype=float)

    start = precondition(movable[:, :, None] * np.random.default_rng(0).normal(size=(count, 3, width)))
    scale = float(np.vdot(start[:, :, 0], multiply(start[:, :, 0])) / np.vdot(start[:, :, 0], start[:, :, 0]))
    with warnings.catch_warnings():  # the spare shapes need not converge
        warnings.filterwarnings("ignore", "Exited", UserWarning)
        values, vectors = lobpcg(
            as_matrix(multiply),
            start.reshape(3 * count, width),
            M=as_matrix(precondition),
            tol=SHAPE_TOLERANCE * scale,
            maxiter=SHAPE_ITERATIONS,
            largest=False,
        )
    return (vectors / np.sqrt(values)).reshape(count, 3, width)[:, :, :SHAPES]


def _second_order_forces(problem: Equilibrium, shapes: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return −∂³E[φⱼ, φₖ] (n, 3, p) of the pairs j, k in ``first`` and ``second`` (p,), by central differences."""
    rest = problem.mesh.nodes
    steps = DIFFERENCE * problem.mesh.size / np.linalg.norm(shapes, axis=1).max(axis=0)

    def curvature(moved: np.ndarray) -> np.ndarray:
        return problem.force(rest + moved) + problem.force(rest - moved)

    of_each = [curvature(step * shape) for step, shape in zip(steps, np.moveaxis(shapes, 2, 0), strict=True)]
    forces = []
    for j, k in zip(first, second, strict=True):
        if j == k:
            forces.append(of_each[j] / steps[j] ** 2)
            continue
        of_pair = curvature(steps[j] * shapes[:, :, j] + steps[k] * shapes[:, :, k])
        forces.append(0.5 * (of_pair - of_each[j] - of_each[k]) / (steps[j] * steps[k]))
    return np.stack(forces, axis=2)


def _inextensible(shapes: np.ndarray, forces: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the numbers of those shapes, softest first, that displacements in the others do not stretch.

    forces, first, second : of ``_second_order_forces``
    Trap: a body that is bent along a straight path is stretched, which a shape that stretches counts as a load: a
    column that is pressed from the side would seem to buckle, where it only bends along an arc. The third derivatives
    of the energy tell these shapes: among those returned they are small.
    """
    count = shapes.shape[2]
    third = np.empty((count, count, count))
    third[first, second] = third[second, first] = np.tensordot(forces, shapes, ((0, 1), (0, 1)))
    allowed, chosen = STRETCH * np.abs(third).max(), [0]
    for shape in range(1, count):
        candidate = [*chosen, shape]
        if np.abs(third[np.ix_(candidate, candidate, candidate)]).max() <= allowed:
            chosen = candidate
    return np.array(chosen)
