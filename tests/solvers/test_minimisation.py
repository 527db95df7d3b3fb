"""Newton's method and L-BFGS on small energies with known minima."""

import numpy as np
import pytest

from palpate.errors import NotConverged
from palpate.linalg.minimiser import minimise_by_lbfgs, minimise_by_newton
from palpate.solvers.equilibrium import Equilibrium


class Chain:
    """Any smooth energy of (n, 3) unknowns from its value, gradient and dense Hessian; where convex, solved exactly."""

    def __init__(self, energy, gradient, hessian):
        self.energy = energy
        self.force = lambda x: -gradient(x)
        self._hessian = hessian

    def linearise(self, x, definite):
        values, vectors = np.linalg.eigh(self._hessian(x))
        if definite:
            values = np.maximum(values, 0.1)
        matrix = vectors @ np.diag(values) @ vectors.T
        inverse = vectors @ np.diag(1.0 / np.maximum(np.abs(values), 1e-3)) @ vectors.T
        return (lambda p: (matrix @ p.ravel()).reshape(p.shape)), (lambda p: (inverse @ p.ravel()).reshape(p.shape))


TARGET = np.array([[0.3, -1.0, 2.0], [0.5, 0.1, -0.7]])
# Σ exp(x − t) − x + ¼ (Σ x − t)²: smooth, convex, minimum at the target
VALLEY = Chain(
    lambda x: float((np.exp(x - TARGET) - x).sum() + 0.25 * (x - TARGET).sum() ** 2),
    lambda x: np.expm1(x - TARGET) + 0.5 * (x - TARGET).sum(),
    lambda x: np.diag(np.exp(x - TARGET).ravel()) + 0.5,
)
# Σ (x² − 1)²/4: a saddle or a hill at every place with an x between −1/√3 and 1/√3
WELLS = Chain(
    lambda x: float(np.sum((x**2 - 1) ** 2) / 4), lambda x: x**3 - x, lambda x: np.diag((3 * x**2 - 1).ravel())
)


def test_finds_the_minimum_and_keeps_count():
    solution = minimise_by_newton(VALLEY, np.zeros((2, 3)), 1.0, 1e-12)
    assert np.abs(solution.x - TARGET).max() < 1e-12
    assert len(solution.history) == len(solution.seconds) == solution.iterations + 1
    assert solution.history[0] == pytest.approx(np.linalg.norm(VALLEY.force(np.zeros((2, 3)))))
    assert solution.history[-1] <= 1e-12
    assert solution.linear_solves == solution.iterations
    assert np.all(np.diff(solution.seconds) >= 0)
    again = minimise_by_newton(VALLEY, TARGET.copy(), 1.0, 1e-12)
    assert again.iterations == 0 and again.linear_solves == 0


def test_rounding_of_the_energy_does_not_reject_the_last_steps():
    rough = Chain(
        lambda x: VALLEY.energy(x) + 1e3 * (1.0 + 1e-13 * np.cos(1e12 * x.sum())),
        lambda x: -VALLEY.force(x),
        VALLEY._hessian,
    )
    for start in np.linspace(-0.5, 0.5, 11):
        solution = minimise_by_newton(rough, TARGET + start, 1.0, 1e-12)
        assert np.abs(solution.x - TARGET).max() < 1e-12 and solution.iterations < 15


def test_converges_quadratically():
    residuals = np.array(minimise_by_newton(VALLEY, TARGET + np.array([1.0, -1.0, 0.5]), 1.0, 1e-13).history)
    before, after = residuals[:-1][residuals[:-1] < 1.0], residuals[1:][residuals[:-1] < 1.0]
    assert len(before) >= 3
    assert np.all(after < np.maximum(before**2, 1e-14))


def test_converges_superlinearly_on_a_body(slab):
    """Inexact Newton with the forcing terms of Eisenstat and Walker, on a dent of a tenth of the body."""
    load = np.zeros_like(slab.fine.nodes)
    load[np.argmax(slab.coarse.nodes @ [1.0, 1.0, 1.0])] = [0.0, -0.1, -0.15]
    solution = Equilibrium(slab, 1).solve(load, 1e-11)
    assert np.abs(solution.x - slab.fine.nodes).max() > 0.1 * slab.fine.size
    residuals = np.array(solution.history)
    assert np.all(residuals[-3:] < np.maximum(3 * residuals[-4:-1] ** 1.5, 1e-11))
    assert residuals[-1] <= 1e-11 and solution.iterations <= 15


def test_leaves_saddles_downhill():
    for seed in range(20):
        random = np.random.default_rng(seed)
        x = random.uniform(0.2, 0.8, (2, 3)) * random.choice([-1, 1], (2, 3))
        solution = minimise_by_newton(WELLS, x, 1.0, 1e-10)
        assert np.abs(np.abs(solution.x) - 1.0).max() < 1e-9
        assert WELLS.energy(solution.x) < 1e-18


def fails(problem, x, **options):
    with pytest.raises(NotConverged) as failure:
        minimise_by_newton(problem, x, 1.0, 1e-10, **options)
    assert f"{failure.value.history[-1]:.1e}" in str(failure.value)
    return failure.value.history


def test_says_so_when_iterations_are_used_up_or_there_is_no_minimum():
    history = fails(VALLEY, TARGET + 5.0, max_iterations=2)
    assert len(history) == 3 and np.isfinite(history).all() and history[0] > history[-1]
    slope = Chain(lambda x: float(-x.sum()), lambda x: -np.ones_like(x), lambda x: np.zeros((6, 6)))
    history = fails(slope, np.zeros((2, 3)))
    assert np.allclose(history, np.sqrt(6.0)) and len(history) == 61


def test_says_so_when_the_energy_does_not_follow_the_force_or_is_infinite():
    """As in a fold of the energy, where steps go uphill; or where an element is inverted whose law forbids it."""
    lying = Chain(lambda x: float(np.abs(x).sum()), lambda x: -np.ones_like(x), lambda x: np.eye(6))
    assert len(fails(lying, np.zeros((2, 3)))) == 1
    forbidden = Chain(lambda x: np.inf, lambda x: -VALLEY.force(x), VALLEY._hessian)
    assert fails(forbidden, np.zeros((2, 3))) == [np.inf]


@pytest.mark.parametrize("broken", ["energy", "force"])
def test_never_returns_what_is_not_a_number(broken):
    def nan_outside(function):
        return lambda x: function(x) if np.abs(x).max() < 0.5 else function(x) * np.nan

    problem = Chain(VALLEY.energy, lambda x: -VALLEY.force(x), VALLEY._hessian)
    setattr(problem, broken, nan_outside(getattr(VALLEY, broken)))
    fails(problem, np.zeros((2, 3)))
    setattr(problem, broken, lambda x: getattr(VALLEY, broken)(x) * np.nan)
    fails(problem, np.zeros((2, 3)))


class Valley:
    """Rosenbrock's, in the first two numbers, and a bowl in the third."""

    def energy(self, x):
        a, b, c = x[0]
        return 100.0 * (b - a * a) ** 2 + (1.0 - a) ** 2 + c * c

    def force(self, x):
        a, b, c = x[0]
        return -np.array([[-400.0 * a * (b - a * a) - 2.0 * (1.0 - a), 200.0 * (b - a * a), 2.0 * c]])


class Bowl:
    """½ xᵀHx − g·x."""

    hessian = np.array([[3.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 1.0]])
    pull = np.array([[1.0, -2.0, 3.0]])

    def energy(self, x):
        return float(0.5 * x[0] @ self.hessian @ x[0] - np.vdot(self.pull, x))

    def force(self, x):
        return self.pull - (self.hessian @ x[0])[None]


def test_one_iteration_solves_what_the_factor_knows_and_more_make_up_for_a_wrong_one():
    """Unless who asks ends the search."""
    start = np.zeros((1, 3))
    x = minimise_by_lbfgs(Bowl(), lambda right: np.linalg.solve(Bowl.hessian, right[0])[None], start, 1e-12, 1).x
    assert np.abs(Bowl().force(x)).max() < 1e-12
    x = minimise_by_lbfgs(Bowl(), lambda right: 0.1 * right, start, 1e-10, 30).x
    assert np.linalg.norm(Bowl().force(x)) <= 1e-10
    way = minimise_by_lbfgs(Bowl(), lambda right: 0.1 * right, start, 1e-10, 30, lambda way: len(way.forces) < 4)
    assert len(way.forces) == 4


def test_a_bent_valley_is_followed_downhill():
    start, valley = np.array([[-1.2, 1.0, 1.0]]), Valley()
    ways = [minimise_by_lbfgs(valley, lambda right: 0.001 * right, start, 1e-9, n) for n in range(0, 80, 4)]
    energies = [valley.energy(way.x) for way in ways]
    assert (np.diff(energies) <= 1e-12).all() and energies[-1] < 1e-12
    for way in ways:
        assert way.forces[-1] == np.linalg.norm(valley.force(way.x)) and len(way.seconds) == len(way.forces)


def test_what_climbs_or_is_not_finite_is_not_followed():
    start = np.zeros((1, 3))
    assert minimise_by_lbfgs(Bowl(), lambda right: -right, start, 1e-9, 5).x is start
    assert minimise_by_lbfgs(Bowl(), lambda right: np.nan * right, start, 1e-9, 5).x is start


class Double:
    """Two wells at a = ±1, with a hill between them."""

    def energy(self, x):
        return 0.25 * float(x[0, 0] ** 4) - 0.5 * float(x[0, 0] ** 2) + float(np.vdot(x[0, 1:], x[0, 1:]))

    def force(self, x):
        return np.array([[x[0, 0] - x[0, 0] ** 3, -2.0 * x[0, 1], -2.0 * x[0, 2]]])


def test_a_hill_on_the_way_is_told():
    """On the hill the force grows along a step; from beyond it the search is in a bowl."""
    on, beyond = (
        minimise_by_lbfgs(Double(), lambda right: 0.3 * right, np.array([[a, 0.0, 0.0]]), 1e-9, 60) for a in (0.1, 0.9)
    )
    assert not on.convex and beyond.convex
    for way in (on, beyond):
        assert np.abs(way.x - [[1.0, 0.0, 0.0]]).max() < 1e-8
