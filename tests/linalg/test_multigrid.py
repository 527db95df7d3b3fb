"""The multigrid preconditioner: its cycle, Galerkin matrices, and as good on fine meshes as on coarse ones."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.effects.linear_elements import LinearElements
from palpate.linalg.block_pattern import hold, pattern_of, product
from palpate.linalg.multigrid import Factor, Multigrid, conjugate_gradients


def indicator(body, level):
    return np.isin(np.arange(len(body.levels[level].nodes)), body.anchors[level])


def prepare(body, x=None, definite=False):
    """Multigrid for the finest level at ``x``, default rest; and its matrix, held and not."""
    patterns = [pattern_of(m.tetrahedra, len(m.nodes)) for m in body.levels]
    held = [indicator(body, level) for level in range(len(body.levels))]
    stiffness = LinearElements(body.fine, body.material, patterns[-1]).stiffness(
        body.fine.nodes if x is None else x, definite
    )
    free = stiffness.copy()
    hold(stiffness.indptr, stiffness.indices, stiffness.data, held[-1])
    multigrid = Multigrid(patterns, body.prolongations, held)
    multigrid.update(stiffness)
    return multigrid, stiffness, free


@pytest.fixture(scope="module")
def three_levels(box, soft):
    mesh = box([3, 2, 2], [0.15, 0.1, 0.1], jitter=0.2)
    return nest("box", mesh, 2, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)


def bent(mesh):
    return mesh.nodes + np.outer(mesh.nodes[:, 0] ** 2, [-1.0, 2.0, 3.0])


def test_coarse_matrices_are_galerkin_products(three_levels):
    multigrid, stiffness, free = prepare(three_levels, bent(three_levels.fine))
    expected = free.toarray()
    values = multigrid.galerkin(stiffness)
    assert np.array_equal(multigrid.patterns[-1].matrix(values[-1]).toarray(), stiffness.toarray())
    for level in (1, 0):
        interpolation = np.kron(three_levels.prolongations[level].toarray(), np.eye(3))
        expected = interpolation.T @ expected @ interpolation
        held = np.repeat(indicator(three_levels, level), 3)
        fixed = np.where(held[:, None] | held, np.eye(len(held)), expected)
        found = multigrid.patterns[level].matrix(values[level]).toarray()
        assert np.abs(found - fixed).max() < 1e-12 * np.abs(fixed).max()


def test_a_cycle_is_smoothing_correcting_and_smoothing_back(slab):
    """Against the same with dense matrices: L, U are the lower and upper block triangles, diagonal included."""
    multigrid, stiffness, free = prepare(slab, bent(slab.fine), definite=True)
    dense, interpolation = stiffness.toarray(), np.kron(slab.prolongations[0].toarray(), np.eye(3))
    node = np.arange(len(dense)) // 3
    lower, upper = np.where(node[:, None] >= node, dense, 0.0), np.where(node[:, None] <= node, dense, 0.0)
    held = np.repeat(indicator(slab, 0), 3)
    coarse = np.where(held[:, None] | held, np.eye(len(held)), interpolation.T @ free.toarray() @ interpolation)
    right = np.random.default_rng(0).normal(size=slab.fine.nodes.shape)
    right[indicator(slab, 1)] = 0.0
    b = right.ravel()
    x = np.linalg.solve(lower, b)
    restricted = np.where(held, 0.0, interpolation.T @ (b - dense @ x))
    x = x + interpolation @ np.linalg.solve(coarse, restricted)
    x = x + np.linalg.solve(upper, b - dense @ x)
    assert np.abs(multigrid.solve(right).ravel() - x).max() < 1e-10 * np.abs(x).max()


def iterations(body):
    multigrid, stiffness, _ = prepare(body)
    right = np.random.default_rng(0).normal(size=body.fine.nodes.shape)
    right[indicator(body, len(body.levels) - 1)] = 0.0

    def multiply(p):
        return (stiffness @ p.ravel()).reshape(p.shape)

    x, products, positive = conjugate_gradients(multiply, multigrid.solve, right, 1e-8, 500)
    assert positive
    assert np.linalg.norm(right - multiply(x)) < 1.1e-8 * np.linalg.norm(right)
    return products


def test_iterations_stay_bounded_as_levels_are_added(box, soft):
    mesh = box([6, 2, 2], [0.3, 0.1, 0.1])
    held = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    counts = [iterations(nest("bar", mesh, levels, held, soft)) for levels in (1, 2, 3)]
    assert max(counts) <= 40
    assert counts[2] <= counts[1] + 5


@pytest.mark.parametrize("count", [1, 3, 17])
def test_right_sides_at_once_have_the_cycles_and_products_of_each(three_levels, count):
    multigrid, stiffness, _ = prepare(three_levels)
    several = np.random.default_rng(0).normal(size=(len(three_levels.fine.nodes), 3, count))
    for act in (multigrid.solve, product(stiffness)):
        each = np.stack([act(np.ascontiguousarray(several[:, :, k])) for k in range(count)], axis=2)
        assert np.abs(act(several) - each).max() < 1e-12 * np.abs(each).max()


@pytest.fixture
def stiffness(slab):
    return LinearElements(slab.coarse, slab.material).stiffness(slab.coarse.nodes)


def test_a_singular_matrix_is_refused(stiffness):
    stiffness.data[:] = 0.0
    with pytest.raises(ValueError, match="singular"):
        Factor(stiffness)
