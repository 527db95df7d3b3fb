"""Whether an equilibrium is stable: the softest direction of the tangent there, and the way on where it gives way.

A body that is pressed along its axis, or a shallow arch, has equilibria that no search leaves on its own, as all forces
balance there; a disturbance of any size does. They are told by a direction along which the tangent stiffness is not
positive. It is sought by Lanczos' method for the tangent over the preconditioner, of which every product is one more
evaluation of the forces.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from palpate.errors import NotConverged
from palpate.linalg.minimiser import Problem, Product, Smooth, Solution, minimise_by_lbfgs, minimise_by_newton

DIFFERENCE = 1e-5
"""Largest displacement, over the body's size, of the differences of forces that give a product with the tangent."""
LEAST_PRODUCTS, MOST_PRODUCTS = 5, 30
"""Least and most products with the tangent. Trap: after one the error bound may be small though a soft direction, of
which the random start has a tenth, is not seen; after five it is seen if there is a thousandth of it."""
SURE = 0.25
"""A positive value is believed once its error bound is below this share of it."""
NEUTRAL = 1e-6
"""Values of the tangent over the preconditioner above minus this are zero: rounding of the differences."""
FIRM = 0.1
"""Softest value of the tangent over that at rest from which on the next level is taken to be stable, too: with a level
it falls by a seventh as a rule and two fifths at most (liver and cylinder, 0.13 to 0.4), and a column has 0.05 at nine
tenths of the load under which it buckles. To find it takes a third of the time of a level."""
GAIN = 1e-9
"""Share of the energy that leaving an equilibrium has to gain; a column of square section, once bent, turns about its
axis so easily that only its mesh resists, and any side is as good."""
LEAST_BEND, BENDS = 1e-5, 12
"""Displacement, over the body's size, by which an unstable equilibrium is left at least, and how often that doubles."""
TURNS = 4
"""How often an equilibrium may be left for another; one does unless a body buckles in several modes."""
TIGHTER = 0.01
"""Share of the tolerance to which the search for another goes on: beside an unstable equilibrium forces are small."""
LBFGS_ITERATIONS = (400, 4000)
"""Iterations of L-BFGS from an equilibrium that is not stable, and again where Newton's method fails after them. Where
the body bends by its own length 400 are few; a square column, once bent, turns about its axis along a valley of the
energy that is curved and almost level, in which Newton's steps stay short."""


class Softest(NamedTuple):
    """The direction (n, 3) along which a body is softest, and the tangent over the preconditioner there."""

    value: float
    direction: np.ndarray


def softest(problem: Smooth, precondition: Product, x: np.ndarray, size: float, sure: float = SURE) -> Softest:
    """Find the direction in which the tangent at ``x`` (n, 3) [m] is softest, or one in which it is negative.

    precondition : a symmetric positive definite map from forces (n, 3) [N] to displacements [m]; size : the body's [m]
    sure : as SURE, of the value
    The value's sign is that of the least eigenvalue of the tangent (Sylvester); its size says how soft the body is
    against its state at rest, if the preconditioner is near the inverse of the stiffness there.
    """
    here, left = problem.force(x), np.random.default_rng(0).normal(size=x.shape)
    left[problem.force(x + DIFFERENCE * size * left) == here] = 0.0  # held nodes bear no force, and are not to move
    step = precondition(left)
    length = np.sqrt(np.vdot(left, step))
    pulls, ways = [left / length], [step / length]
    diagonal: list[float] = []
    beside: list[float] = []
    while True:
        way = ways[-1]
        h = DIFFERENCE * size / np.abs(way).max()
        left = (here - problem.force(x + h * way)) / h
        diagonal.append(float(np.vdot(way, left)))
        for pull, other in zip(pulls, ways, strict=True):  # all, as rounding makes them lose what two would do
            left -= float(np.vdot(other, left)) * pull
        step = precondition(left)
        length = float(np.sqrt(max(np.vdot(left, step), 0.0)))
        values, vectors = np.linalg.eigh(np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1))
        value, mix = float(values[0]), vectors[:, 0]
        known = len(diagonal) >= LEAST_PRODUCTS and length * abs(mix[-1]) <= sure * value
        if value < -NEUTRAL or known or len(diagonal) >= MOST_PRODUCTS or length < 1e-12:
            return Softest(value, np.tensordot(mix, np.array(ways), 1))
        beside.append(length)
        pulls.append(left / length)
        ways.append(step / length)


def made_stable(
    problem: Smooth,
    precondition: Callable[[], Product],
    size: float,
    solution: Solution,
    settle: Callable[[np.ndarray], Solution],
) -> Solution:
    """Return ``solution`` if it is stable; else follow the softest direction to where the body is.

    precondition : makes what ``softest`` takes; settle : from positions (n, 3) [m] to an equilibrium of less energy
    Raises NotConverged if none is found that is stable.
    """
    for _ in range(TURNS):
        found = softest(problem, precondition(), solution.x, size)
        if found.value >= -NEUTRAL:
            return solution
        before = problem.energy(solution.x)
        solution = settle(_bent(problem, solution.x, found.direction, size)).after(solution)
        if before - problem.energy(solution.x) < GAIN * abs(before):
            return solution
    raise NotConverged(f"no stable equilibrium was found: the body gave way {TURNS} times", solution.history)


def _bent(problem: Smooth, x: np.ndarray, direction: np.ndarray, size: float) -> np.ndarray:
    """Return the positions (n, 3) [m] of the least energy on either side of ``x`` along ``direction`` (n, 3).

    Below the energy at ``x`` no descent leads back there. Trap: farther off the energy is higher again, as a straight
    way stretches what bends.
    """
    unit = size / np.linalg.norm(direction, axis=1).max() * direction
    ways = [side * LEAST_BEND * 2.0**k for k in range(BENDS) for side in (1.0, -1.0)]
    energies = [problem.energy(x + way * unit) for way in ways]
    return x + ways[int(np.argmin(np.nan_to_num(energies, nan=np.inf)))] * unit


def settle_from_unstable(problem: Problem, at_rest: Product, x: np.ndarray, scale: float, tolerance: float) -> Solution:
    """Find the equilibrium that a body comes to from ``x`` (n, 3) [m] beside an unstable one.

    at_rest : the preconditioner of the state at rest; scale : of the forces [N], over which ``tolerance`` is
    By L-BFGS first, which never climbs and needs no positive stiffness, then by Newton's method. Raises NotConverged.
    """
    spent = None
    for iterations in LBFGS_ITERATIONS:
        way = minimise_by_lbfgs(problem, at_rest, x, TIGHTER * tolerance * scale, iterations)
        x, found = way.x, way.solution(scale)
        spent = found if spent is None else found.after(spent)
        if way.forces[-1] <= tolerance * scale:
            return spent
        try:
            return minimise_by_newton(problem, x, scale, tolerance).after(spent)
        except NotConverged as failure:
            last = failure
    raise NotConverged(f"the body buckles, and where it goes was not found: {last}", last.history) from last
