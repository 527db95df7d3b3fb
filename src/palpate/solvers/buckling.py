"""How near a load is to the one at which the body buckles, linearised at rest, for presses at any place at once.

In the softest shapes φ of the body at rest, where the stiffness is the identity, a load changes the stiffness by the
work that it does on their second-order motions: −f · sⱼₖ with sⱼₖ = −K⁻¹ ∂³E[φⱼ, φₖ], the static derivatives (Idelsohn
and Cardona 1985). A column that bends becomes shorter, and what presses on its end helps to bend it. The body buckles
where an eigenvalue of that work is 1.
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
"""Shapes of the body: of a column two pairs that bend, one that twists and one that shortens."""
SHAPE_TOLERANCE, SHAPE_ITERATIONS, SPARE = 1e-3, 40, 3
"""Relative residual of the shapes, most iterations for them, and how many more are iterated, which converge later."""
STRETCH = 0.1
"""Energy of the third order of shapes that do not stretch each other, over the largest there is."""
BEND = 0.005
"""Largest displacement of the differences, over the body's size."""
RESIDUAL = 1e-3


class Buckling:
    """The second-order motions of the softest shapes of ``body``, of quadratic elements on its coarsest level.

    radius_m : of the discs that are pressed [m]
    """

    def __init__(self, body: Body, radius_m: float):
        whole = body if len(body.levels) > 1 else with_midpoints(body, 0)
        problem = Equilibrium(whole, 0, order=2)
        self._body, self._radius_m = body, radius_m
        self._pulls: dict[int, tuple[np.ndarray, float]] = {}
        multiply, precondition = problem.linearise(problem.mesh.nodes)
        shapes = _softest(multiply, precondition, len(problem.mesh.nodes), whole.anchors[1])
        first, second = np.triu_indices(shapes.shape[2])
        pulls = _bends(problem, shapes, first, second)
        kept = _unstretched(shapes, pulls, first, second)
        inside = np.isin(first, kept) & np.isin(second, kept)
        first, second = np.searchsorted(kept, first[inside]), np.searchsorted(kept, second[inside])
        shapes, bent = shapes[:, :, kept], linear_response(multiply, precondition, pulls[:, :, inside], RESIDUAL)
        self._motions = np.empty((*shapes.shape[:2], shapes.shape[2], shapes.shape[2]))
        self._motions[:, :, first, second] = self._motions[:, :, second, first] = bent

    def share(self, presses: Iterable[tuple[int, np.ndarray]], enough: float = 0.0) -> float:
        """Return the load over the one at which the body buckles, 0 if none of that direction makes it.

        presses : fine surface nodes, and the force (3,) [N] on the disc around each
        enough : a share that matters; an upper bound which is not above it is returned in place of the share
        """
        pulls = [(force, *self._pull(node)) for node, force in presses]
        bound = sum(sqrt(np.dot(force, force)) * most for force, _, most in pulls)
        if bound <= enough:
            return bound
        wide = self._motions.shape[2]
        work = sum(force @ pull for force, pull, _ in pulls).reshape(wide, wide)
        return max(float(np.linalg.eigvalsh(work)[-1]), 0.0)

    def _pull(self, node: int) -> tuple[np.ndarray, float]:
        """Return the work (3, r²) that unit forces on the disc around a node do on second-order motions.

        And the largest norm that any of them gives it [1/N], which no eigenvalue exceeds.
        """
        if node not in self._pulls:
            nodes, shares = patch_shares(self._body.coarse, patch_at(self._body, node, self._radius_m), 2)
            pull = np.tensordot(shares, self._motions[nodes], 1).reshape(3, -1)
            self._pulls[node] = pull, float(np.linalg.norm(pull, 2))
        return self._pulls[node]


def _softest(multiply: Product, precondition: Product, count: int, held: np.ndarray) -> np.ndarray:
    """Return shapes (n, 3, r) in which the stiffness is the identity, those of least energy for their size."""
    free = np.ones((count, 3))
    free[held] = 0.0
    wide = min(SHAPES + SPARE, int(free.sum()) // 5)

    def operator(apply: Product) -> LinearOperator:
        def product(x: np.ndarray) -> np.ndarray:
            return apply(np.ascontiguousarray(x.reshape(count, 3, -1))).reshape(x.shape)

        return LinearOperator((3 * count, 3 * count), product, matmat=product, dtype=float)

    start = precondition(free[:, :, None] * np.random.default_rng(0).normal(size=(count, 3, wide)))
    scale = float(np.vdot(start[:, :, 0], multiply(start[:, :, 0])) / np.vdot(start[:, :, 0], start[:, :, 0]))
    with warnings.catch_warnings():  # of the spare ones, which need not converge
        warnings.filterwarnings("ignore", "Exited", UserWarning)
        values, vectors = lobpcg(
            operator(multiply),
            start.reshape(3 * count, wide),
            M=operator(precondition),
            tol=SHAPE_TOLERANCE * scale,
            maxiter=SHAPE_ITERATIONS,
            largest=False,
        )
    return (vectors / np.sqrt(values)).reshape(count, 3, wide)[:, :, :SHAPES]


def _bends(problem: Equilibrium, shapes: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return −∂³E[φⱼ, φₖ] (n, 3, p) of the pairs j, k in ``first`` and ``second`` (p,), by central differences."""
    rest = problem.mesh.nodes
    steps = BEND * problem.mesh.size / np.linalg.norm(shapes, axis=1).max(axis=0)

    def bend(moved: np.ndarray) -> np.ndarray:
        return problem.force(rest + moved) + problem.force(rest - moved)

    own = [bend(step * shape) for step, shape in zip(steps, np.moveaxis(shapes, 2, 0), strict=True)]
    found = []
    for j, k in zip(first, second, strict=True):
        if j == k:
            found.append(own[j] / steps[j] ** 2)
            continue
        both = bend(steps[j] * shapes[:, :, j] + steps[k] * shapes[:, :, k])
        found.append(0.5 * (both - own[j] - own[k]) / (steps[j] * steps[k]))
    return np.stack(found, axis=2)


def _unstretched(shapes: np.ndarray, pulls: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the numbers of those shapes, softest first, that a motion in the others does not stretch.

    Trap: what bends in a straight line is longer, and a shape that stretches takes that for a load. A column that is
    pressed from the side would seem to buckle, where all that it has to do is to bend along an arc. The energies of
    the third order show which shapes do: of those kept they are small.
    """
    wide = shapes.shape[2]
    third = np.empty((wide, wide, wide))
    third[first, second] = third[second, first] = np.tensordot(pulls, shapes, ((0, 1), (0, 1)))
    least, kept = STRETCH * np.abs(third).max(), [0]
    for shape in range(1, wide):
        more = [*kept, shape]
        if np.abs(third[np.ix_(more, more, more)]).max() <= least:
            kept = more
    return np.array(kept)
