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
def check_derivatives(differences) -> Callable[..., None]:
    """Compare the force and the stiffness of ``elasticity`` at ``x`` with differences, in steps of 1e-6 ``size``."""

    def check(elasticity, x, size):
        force, stiffness = elasticity.force(x), elasticity.stiffness(x).toarray()
        slope = differences(elasticity.energy, x, 1e-6 * size).reshape(x.shape)
        assert np.abs(force + slope).max() < 1e-7 * np.abs(force).max()
        slope = -differences(elasticity.force, x, 1e-6 * size)
        assert np.abs(stiffness - slope).max() < 1e-6 * np.abs(stiffness).max()
        assert np.abs(stiffness - stiffness.T).max() < 1e-13 * np.abs(stiffness).max()

    return check
