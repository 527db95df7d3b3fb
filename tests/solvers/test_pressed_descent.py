"""A descent that knows the stiffness of contact finds the end of a linear problem in one step."""

import numpy as np
import pytest

from palpate.effects.instrument import Instrument, upright
from palpate.effects.instrument_penalty import NodeContact
from palpate.solvers.pressed_descent import PressedDescent


class Quadratic:
    """E = ½ u·K u of displacements u from rest."""

    def __init__(self, matrix, rest):
        self._matrix, self._rest = matrix, rest

    def energy(self, x):
        u = (x - self._rest).ravel()
        return 0.5 * float(u @ self._matrix @ u)

    def add_force(self, x, v, force):
        force -= (self._matrix @ (x - self._rest).ravel()).reshape(x.shape)


@pytest.mark.parametrize("isotropic", [True, False])
def test_one_step_solves_what_is_linear(isotropic):
    """The end of a punch is flat, so that contact is linear, too, as long as the same nodes touch."""
    rng, count = np.random.default_rng(1), 6
    parts = rng.standard_normal((count, count)) if isotropic else rng.standard_normal((3 * count, 3 * count))
    matrix = parts @ parts.T + np.eye(len(parts))
    matrix = np.kron(matrix, np.eye(3)) if isotropic else matrix
    rest = np.column_stack([rng.uniform(-0.01, 0.01, (count, 2)), [1e-3, 2e-3, 1.5e-3, -1.0, -1.0, -1.0]])
    contact = NodeContact(
        np.arange(count), np.full(count, 0.1), upright(Instrument("punch", 1.0), np.zeros(3), [0.2, 0.1, 1])
    )
    overlaps, normals = contact.overlaps(rest)
    assert np.array_equal(overlaps > 0.0, [True] * 3 + [False] * 3)

    def solve(right):
        return np.linalg.solve(matrix, right.ravel()).reshape(right.shape)

    descent = PressedDescent([Quadratic(matrix, rest)], contact, np.zeros(count, dtype=bool), solve, isotropic)
    x = descent.relax(rest, 1, 0, 1e-12)
    whole = matrix.copy()
    for i in range(3):
        own = slice(3 * i, 3 * i + 3)
        whole[own, own] += 0.1 * np.outer(normals[i], normals[i])
    right = (0.1 * overlaps[:, None] * normals).ravel()
    assert x - rest == pytest.approx(np.linalg.solve(whole, right).reshape(-1, 3), rel=1e-9, abs=1e-15)
