"""Conjugate gradients against a direct solution, and what they say about indefinite matrices."""

import numpy as np
import pytest

from palpate.errors import NotConverged
from palpate.linalg.multigrid import conjugate_gradients, linear_response


def nothing(residual):
    return residual


def symmetric(values):
    """A matrix with these eigenvalues, and its product with (n, 3) arrays."""
    basis = np.linalg.qr(np.random.default_rng(0).normal(size=(len(values), len(values))))[0]
    matrix = basis @ np.diag(values) @ basis.T
    return matrix, lambda p: (matrix @ p.ravel()).reshape(p.shape)


RIGHT = np.random.default_rng(1).normal(size=(20, 3))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-8, 1e-12])
def test_solves_to_the_tolerance_and_counts_products(tolerance):
    matrix, multiply = symmetric(np.geomspace(1.0, 100.0, 60))
    calls = []

    def counted(p):
        calls.append(p)
        return multiply(p)

    x, products, positive = conjugate_gradients(counted, nothing, RIGHT, tolerance, 500)
    assert positive and products == len(calls)
    assert np.linalg.norm(multiply(x) - RIGHT) <= 1.01 * tolerance * np.linalg.norm(RIGHT)
    exact = np.linalg.solve(matrix, RIGHT.ravel()).reshape(RIGHT.shape)
    assert np.linalg.norm(x - exact) <= 100 * tolerance * np.linalg.norm(exact)


def test_an_exact_preconditioner_needs_one_step():
    matrix, multiply = symmetric(np.geomspace(1e-6, 1e6, 60))
    _, products, positive = conjugate_gradients(
        multiply, lambda r: np.linalg.solve(matrix, r.ravel()).reshape(r.shape), RIGHT, 1e-4, 500
    )
    assert positive and products == 1


def test_stops_at_the_last_iteration_allowed():
    _, multiply = symmetric(np.geomspace(1.0, 1e8, 60))
    x, products, positive = conjugate_gradients(multiply, nothing, RIGHT, 1e-12, 5)
    assert products == 5 and positive and np.isfinite(x).all()


def test_negative_curvature_is_noticed_and_what_is_returned_descends():
    values = np.linspace(1.0, 10.0, 60)
    values[7] = -5.0
    matrix, multiply = symmetric(values)
    x, _, positive = conjugate_gradients(multiply, nothing, RIGHT, 1e-12, 500)
    assert not positive and np.isfinite(x).all()
    assert np.vdot(x, RIGHT) > 0.0
    # up to there the quadratic model fell
    assert 0.5 * np.vdot(x, multiply(x)) - np.vdot(x, RIGHT) < 0.0
    assert np.linalg.eigvalsh(matrix)[0] == pytest.approx(-5.0)


def test_a_negative_or_broken_operator_gives_nothing():
    for multiply, precondition in (
        (lambda p: -p, nothing),
        (nothing, lambda r: -r),
        (lambda p: np.nan * p, nothing),
        (nothing, lambda r: np.nan * r),
    ):
        x, _, positive = conjugate_gradients(multiply, precondition, RIGHT, 1e-10, 100)
        assert not positive and not x.any()


def test_right_sides_at_once_have_the_answers_of_each_by_itself():
    matrix, _ = symmetric(np.geomspace(1.0, 100.0, 60))
    several = np.random.default_rng(2).normal(size=(20, 3, 4)) * [1.0, 1e6, 1e-6, 1.0]

    def multiply(p):
        return (matrix @ p.reshape(60, -1)).reshape(p.shape)

    x, _, positive = conjugate_gradients(multiply, nothing, several, 1e-10, 500)
    assert positive
    for k in range(4):
        alone = conjugate_gradients(multiply, nothing, np.ascontiguousarray(several[:, :, k]), 1e-10, 500)[0]
        assert np.abs(x[:, :, k] - alone).max() < 1e-7 * np.abs(alone).max()


DIAGONAL = np.linspace(1.0, 5.0, 30).reshape(10, 3)


def multiply(x):
    return (DIAGONAL if x.ndim == 2 else DIAGONAL[:, :, None]) * x


def test_a_load_of_zero_among_others_moves_nothing():
    loads = np.random.default_rng(0).normal(size=(10, 3, 4))
    loads[:, :, 2] = 0.0
    found = linear_response(multiply, nothing, loads, 1e-10)
    assert found == pytest.approx(loads / DIAGONAL[:, :, None], abs=1e-8)
    assert not found[:, :, 2].any() and not linear_response(multiply, nothing, loads[:, :, 2], 1e-10).any()


def test_what_does_not_converge_is_an_error():
    loads = np.ones((10, 3, 2))
    loads[0, 0, 1] = np.nan
    for right in (loads, loads[:, :, 1]):
        with pytest.raises(NotConverged, match="relative residual of nan, above the tolerance"):
            linear_response(multiply, nothing, right, 1e-10)
    with pytest.raises(NotConverged, match="stopped after 1 products"):
        linear_response(lambda x: -multiply(x), nothing, loads[:, :, :1], 1e-10)
