"""BFGS finds minima, keeps what it has learnt for the next one, and says where it cannot."""

import numpy as np

from palpate.models.reduced_motion import CarriedBfgs

HESSIAN = np.array([[3.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 1.0]])


class Bowl:
    """½ qᵀHq − pull·q, which counts its calls."""

    def __init__(self, pull):
        self.pull, self.calls = np.array(pull), 0

    def __call__(self, q):
        self.calls += 1
        return float(0.5 * q @ HESSIAN @ q - self.pull @ q), HESSIAN @ q - self.pull


def rosenbrock(q):
    a, b = q
    value = 100.0 * (b - a * a) ** 2 + (1.0 - a) ** 2
    return value, np.array([-400.0 * a * (b - a * a) - 2.0 * (1.0 - a), 200.0 * (b - a * a)])


def test_the_next_minimum_is_found_in_fewer_steps():
    search, first, second = CarriedBfgs(np.ones(3)), Bowl([1.0, -2.0, 3.0]), Bowl([-3.0, 1.0, 2.0])
    for bowl in (first, second):
        q, left = search.minimise(bowl, np.zeros(3), 1e-6, 0.0, 50)
        assert left <= 1e-6 and np.abs(HESSIAN @ q - bowl.pull).max() <= 1e-6
    assert second.calls <= 5 < 8 < first.calls


def test_a_bent_valley_is_followed_downhill():
    q, left = CarriedBfgs(np.full(2, 0.01)).minimise(rosenbrock, np.array([-1.2, 1.0]), 1e-8, 0.0, 100)
    assert left <= 1e-8 and np.abs(q - 1.0).max() < 1e-7


def test_it_says_what_is_left_where_iterations_end_and_nothing_where_rounding_ends_the_search():
    start = np.array([-1.2, 1.0])
    assert CarriedBfgs(np.full(2, 0.01)).minimise(rosenbrock, start, 1e-8, 0.0, 3)[1] > 1e-3
    bowl = Bowl([1.0, -2.0, 3.0])

    def coarse(q):
        value, gradient = bowl(q)
        return value + 1e-9 * np.sin(1e9 * q.sum()), gradient + 1e-7

    assert CarriedBfgs(np.ones(3)).minimise(coarse, np.zeros(3), 1e-14, 0.0, 40)[1] > 1e-14
    q, left = CarriedBfgs(np.ones(3)).minimise(coarse, np.zeros(3), 1e-14, 1e-8, 60)
    assert left <= 1e-14 and np.abs(HESSIAN @ q - bowl.pull).max() < 1e-4


def test_a_hessian_that_leads_nowhere_is_forgotten():
    search = CarriedBfgs(np.ones(3))
    search._inverse = -np.eye(3)
    q, left = search.minimise(Bowl([1.0, -2.0, 3.0]), np.zeros(3), 1e-8, 0.0, 50)
    assert left <= 1e-8
    assert search.minimise(lambda q: (0.0, np.full(3, np.nan)), q, 1e-8, 0.0, 50)[1] != 0.0
