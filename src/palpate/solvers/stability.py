"""Stability of an equilibrium: the softest direction of the tangent stiffness, and the state that a body buckles to.

A body that is pressed along its axis, or a shallow arch, has equilibria that no search leaves by itself, as all forces
balance there, but any disturbance does. They have a direction along which the tangent stiffness is not positive. It is
found by Lanczos' method for the tangent relative to the preconditioner, a product of which is a difference of forces.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from palpate.errors import NotConverged
from palpate.linalg.minimiser import Problem, Product, Smooth, Solution, minimise_by_lbfgs, minimise_by_newton

DIFFERENCE = 1e-5
"""Largest displacement, over the body's size, in the difference of forces that is a product with the tangent."""
LEAST_PRODUCTS, MOST_PRODUCTS = 5, 30
"""Least and most products with the tangent. Trap: after one product the error bound may be small although a soft
direction, a tenth of the random start, is missing; after five a thousandth of it suffices."""
SURE = 0.25
"""Error bound of a positive value, over the value, at which the search for a softer direction ends."""
NEUTRAL = 1e-6
"""Values of the tangent over the preconditioner above minus this are zero: rounding of the differences."""
FIRM = 0.1
"""Least value of the tangent over that at rest at which the next finer level is taken to be stable, too. From a level
to the next it falls by a seventh as a rule and by two fifths at most (liver and cylinder, 0.13 to 0.4); a column has
0.05 at nine tenths of its critical load. To compute it takes a third of the time of a level."""
GAIN = 1e-9
"""Least decrease of the energy, relative, by which a state is left for another: a bent column of square section turns
about its axis with hardly any resistance but that of its mesh, and any side is as good."""
LEAST_BEND, BENDS = 1e-5, 12
"""Least displacement, over the body's size, that is tried from an unstable equilibrium, and how often it doubles."""
TURNS = 4
"""Most equilibria that are left for another; one is enough unless a body buckles in several modes."""
TIGHTER = 0.01
"""Tolerance of the search for another state, over the given one: beside an unstable equilibrium forces are small."""
LBFGS_ITERATIONS = (400, 4000)
"""Iterations of L-BFGS from an equilibrium that is not stable, and again where Newton's method fails after them. Where
the body bends by its own length 400 are few: a bent square column turns about its axis along a curved and almost level
valley of the energy, in which Newton's steps stay short."""


class Softest(NamedTuple):
    """The softest direction (n, 3) of a body, and the ``value`` of the tangent over the preconditioner along it."""

    value: float
    direction: np.ndarray


def softest(problem: Smooth, precondition: Product, x: np.ndarray, size: float, sure: float = SURE) -> Softest:
    """Return the softest direction of the tangent at ``x`` (n, 3) [m], or the first one in which it is negative.

    precondition : a symmetric positive definite map from forces (n, 3) [N] to displacements [m]; size : the body's [m]
    sure : error bound of a positive value, over it, at which the search ends
    The value has the sign of the least eigenvalue of the tangent (Sylvester). It is the softness relative to the state
    at rest if the preconditioner is near the inverse of the stiffness there.
    """
    force0, residual = problem.force(x), np.random.default_rng(0).normal(size=x.shape)
    residual[problem.force(x + DIFFERENCE * size * residual) == force0] = 0.0  # held nodes, whose force is always zero
    step = precondition(residual)
    length = np.sqrt(np.vdot(residual, step))
    forces, directions = [residual / length], [step / length]  # Lanczos vectors, before and after preconditioning
    diagonal: list[float] = []
    off_diagonal: list[float] = []
    while True:
        direction = directions[-1]
        step_m = DIFFERENCE * size / np.abs(direction).max()
        residual = (force0 - problem.force(x + step_m * direction)) / step_m
        diagonal.append(float(np.vdot(direction, residual)))
        # orthogonal to all earlier vectors, as rounding makes those lose orthogonality to the last two
        for force, earlier in zip(forces, directions, strict=True):
            residual -= float(np.vdot(earlier, residual)) * force
        step = precondition(residual)
        length = float(np.sqrt(max(np.vdot(residual, step), 0.0)))
        values, vectors = np.linalg.eigh(np.diag(diagonal) + np.diag(off_diagonal, 1) + np.diag(off_diagonal, -1))
        value, weights = float(values[0]), vectors[:, 0]
        certain = len(diagonal) >= LEAST_PRODUCTS and length * abs(weights[-1]) <= sure * value
        if value < -NEUTRAL or certain or len(diagonal) >= MOST_PRODUCTS or length < 1e-12:
            return Softest(value, np.tensordot(weights, np.array(directions), 1))
        off_diagonal.append(length)
        forces.append(residual / length)
        directions.append(step / length)


def made_stable(
    problem: Smooth,
    precondition: Callable[[], Product],
    size: float,
    solution: Solution,
    settle: Callable[[np.ndarray], Solution],
) -> Solution:
    """Return ``solution`` if it is stable, or else the stable equilibrium that the body buckles to from there.

    precondition : makes the map that ``softest`` takes; size : of the body [m]
    settle : from positions (n, 3) [m] to an equilibrium of less energy
    Raises NotConverged if no stable equilibrium is found.
    """
    for _ in range(TURNS):
        mode = softest(problem, precondition(), solution.x, size)
        if mode.value >= -NEUTRAL:
            return solution
        energy = problem.energy(solution.x)
        solution = settle(_bent(problem, solution.x, mode.direction, size)).after(solution)
        if energy - problem.energy(solution.x) < GAIN * abs(energy):
            return solution
    raise NotConverged(f"no stable equilibrium was found: the body gave way {TURNS} times", solution.history)


def _bent(problem: Smooth, x: np.ndarray, direction: np.ndarray, size: float) -> np.ndarray:
    """Return the positions (n, 3) [m] of least energy among some on either side of ``x`` along ``direction`` (n, 3).

    As their energy is below that at ``x``, no descent leads back there. Trap: farther away the energy is higher again,
    as a straight path stretches a body that bends.
    """
    unit = size / np.linalg.norm(direction, axis=1).max() * direction
    distances = [side * LEAST_BEND * 2.0**k for k in range(BENDS) for side in (1.0, -1.0)]
    energies = [problem.energy(x + distance * unit) for distance in distances]
    return x + distances[int(np.argmin(np.nan_to_num(energies, nan=np.inf)))] * unit


def settle_from_unstable(problem: Problem, at_rest: Product, x: np.ndarray, scale: float, tolerance: float) -> Solution:
    """Find the equilibrium that a body goes to from ``x`` (n, 3) [m] beside an unstable one.

    at_rest : the preconditioner of the state at rest; tolerance : of the residual, over ``scale`` [N]
    L-BFGS comes first, as it never raises energy nor needs positive stiffness, then Newton's. NotConverged if all fail.
    """
    spent = None
    for iterations in LBFGS_ITERATIONS:
        descent = minimise_by_lbfgs(problem, at_rest, x, TIGHTER * tolerance * scale, iterations)
        x, solution = descent.x, descent.solution(scale)
        spent = solution if spent is None else solution.after(spent)
        if descent.forces[-1] <= tolerance * scale:
            return spent
        try:
            return minimise_by_newton(problem, x, scale, tolerance).after(spent)
        except NotConverged as failure:
            newest = failure
    raise NotConverged(f"the body buckles, and where it goes was not found: {newest}", newest.history) from newest
