"""What the tests of effects ask of every effect."""

from collections.abc import Callable

import numpy as np
import pytest

from palpate.linalg.block_pattern import shared_pattern


@pytest.fixture(scope="session")
def force_of() -> Callable[..., np.ndarray]:
    """The nodal forces (n, 3) of an effect at ``x``, at rest."""

    def force_of(effect, x):
        force = np.zeros_like(x)
        effect.add_force(x, np.zeros_like(x), force)
        return force

    return force_of


@pytest.fixture(scope="session")
def stiffness_of() -> Callable[..., np.ndarray]:
    """The stiffness (3n, 3n) of an effect at ``x``."""

    def stiffness_of(effect, x, definite=False):
        pattern = shared_pattern([effect.couples], len(x))
        values = np.zeros((len(pattern.indices), 3, 3))
        effect.add_stiffness(x, definite, pattern.slots[0], values)
        return pattern.matrix(values).toarray()

    return stiffness_of


@pytest.fixture(scope="session")
def differences() -> Callable[..., np.ndarray]:
    """Central differences of a function along every coordinate of ``x``, one row each."""

    def differences(function, x, step):
        rows = []
        for delta in step * np.eye(x.size).reshape(-1, *x.shape):
            rows.append((np.asarray(function(x + delta)) - np.asarray(function(x - delta))).ravel() / (2 * step))
        return np.array(rows)

    return differences


@pytest.fixture(scope="session")
def check_derivatives(differences, force_of, stiffness_of) -> Callable[..., None]:
    """Compare force and stiffness of an effect at ``x`` with differences, relative to the largest of each."""

    def check(effect, x, step, force_error=1e-7, stiffness_error=1e-6, symmetry=1e-13):
        force, stiffness = force_of(effect, x), stiffness_of(effect, x)
        slope = differences(effect.energy, x, step).reshape(x.shape)
        assert np.abs(force + slope).max() < force_error * np.abs(force).max()
        slope = -differences(lambda y: force_of(effect, y), x, step)
        assert np.abs(stiffness - slope).max() < stiffness_error * np.abs(stiffness).max()
        assert np.abs(stiffness - stiffness.T).max() < symmetry * np.abs(stiffness).max()

    return check


@pytest.fixture(scope="session")
def check_frame(rotation, force_of) -> Callable[..., None]:
    """Energy and force at ``x`` move with the body, and forces and their moments over a length ``size`` balance."""

    def check(effect, x, size, error=1e-12, balance=1e-12):
        force, turn = force_of(effect, x), rotation(0.7)
        assert effect.energy(x @ turn.T + [1, 2, -0.5]) == pytest.approx(effect.energy(x), rel=error)
        assert np.abs(force_of(effect, x @ turn.T) - force @ turn.T).max() < error * np.abs(force).max()
        assert np.abs(force.sum(axis=0)).max() < balance * np.abs(force).sum()
        assert np.abs(np.cross(x, force).sum(axis=0)).max() < balance * np.abs(force).sum() * size

    return check
