"""Direct solution of block systems."""

import numpy as np
import pytest

from palpate.effects.linear_elements import LinearElements
from palpate.linalg.block_pattern import hold
from palpate.linalg.multigrid import Factor


@pytest.fixture
def stiffness(slab):
    return LinearElements(slab.coarse, slab.material).stiffness(slab.coarse.nodes)


def test_solves_a_held_body(slab, stiffness):
    held = np.isin(np.arange(len(slab.coarse.nodes)), slab.anchors[0])
    hold(stiffness.indptr, stiffness.indices, stiffness.data, held)
    right = np.random.default_rng(0).normal(size=slab.coarse.nodes.shape)
    expected = np.linalg.solve(stiffness.toarray(), right.ravel()).reshape(right.shape)
    assert np.abs(Factor(stiffness).solve(right) - expected).max() < 1e-10 * np.abs(expected).max()


def test_a_singular_matrix_is_refused(stiffness):
    stiffness.data[:] = 0.0
    with pytest.raises(ValueError, match="singular"):
        Factor(stiffness)
