"""L-BFGS from a constant factor finds minima, never climbs, and ends where nothing is left to gain."""

import numpy as np

from palpate.solvers.lbfgs import descend


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


def test_one_iteration_solves_what_the_factor_knows():
    def solve(right):
        return np.linalg.solve(Bowl.hessian, right[0])[None]

    x = descend(Bowl(), solve, np.zeros((1, 3)), 1e-12, 1).x
    assert np.abs(Bowl().force(x)).max() < 1e-12


def test_a_wrong_factor_is_made_up_for():
    x = descend(Bowl(), lambda right: 0.1 * right, np.zeros((1, 3)), 1e-10, 30).x
    assert np.linalg.norm(Bowl().force(x)) <= 1e-10


def test_a_bent_valley_is_followed_downhill():
    start, valley = np.array([[-1.2, 1.0, 1.0]]), Valley()
    ways = [descend(valley, lambda right: 0.001 * right, start, 1e-9, n) for n in range(0, 80, 4)]
    energies = [valley.energy(way.x) for way in ways]
    assert (np.diff(energies) <= 1e-12).all() and energies[-1] < 1e-12
    for way in ways:
        assert way.forces[-1] == np.linalg.norm(valley.force(way.x)) and len(way.seconds) == len(way.forces)


def test_what_climbs_or_is_not_finite_is_not_followed():
    start = np.zeros((1, 3))
    assert descend(Bowl(), lambda right: -right, start, 1e-9, 5).x is start
    assert descend(Bowl(), lambda right: np.nan * right, start, 1e-9, 5).x is start


class Double:
    """Two wells at a = ±1, with a hill between them."""

    def energy(self, x):
        return 0.25 * float(x[0, 0] ** 4) - 0.5 * float(x[0, 0] ** 2) + float(np.vdot(x[0, 1:], x[0, 1:]))

    def force(self, x):
        return np.array([[x[0, 0] - x[0, 0] ** 3, -2.0 * x[0, 1], -2.0 * x[0, 2]]])


def test_a_hill_on_the_way_is_told():
    """On the hill the force grows along a step; from beyond it the search is in a bowl."""
    on, beyond = (descend(Double(), lambda right: 0.3 * right, np.array([[a, 0.0, 0.0]]), 1e-9, 60) for a in (0.1, 0.9))
    assert not on.convex and beyond.convex
    for way in (on, beyond):
        assert np.abs(way.x - [[1.0, 0.0, 0.0]]).max() < 1e-8


def test_who_asks_may_end_the_search():
    way = descend(Bowl(), lambda right: 0.1 * right, np.zeros((1, 3)), 1e-10, 30, lambda way: len(way.forces) < 4)
    assert len(way.forces) == 4
