"""Block patterns against a dense assembly."""

import numpy as np

from palpate.linalg.block_pattern import hold, pattern_of, product, shared_pattern


def test_hold_makes_rows_and_columns_those_of_the_identity(box):
    mesh = box([2, 2, 1], [1, 1, 1])
    pattern = pattern_of(mesh.tetrahedra, len(mesh.nodes))
    values = np.random.default_rng(0).normal(size=(len(pattern.indices), 3, 3))
    expected = pattern.matrix(values.copy()).toarray()
    held = np.zeros(len(mesh.nodes), dtype=bool)
    held[[0, 5, 7]] = True
    components = np.repeat(held, 3)
    expected[components] = 0.0
    expected[:, components] = 0.0
    expected[components, components] = 1.0
    hold(pattern.indptr, pattern.indices, values, held)
    assert np.array_equal(pattern.matrix(values).toarray(), expected)


def test_one_pattern_for_several_kinds_of_elements():
    """Against sorted keys of all pairs; one kind has no element, one node occurs twice in an element."""
    random, n = np.random.default_rng(0), 53
    couples = [random.integers(0, 50, (40, 4)), random.integers(0, 50, (30, 2)), np.empty((0, 3), dtype=int)]
    couples.append(np.array([[7, 7, 3]]))
    pattern = shared_pattern(couples, n)
    keys = [nodes[:, :, None] * n + nodes[:, None, :] for nodes in couples]
    known = np.unique(np.concatenate([*(k.ravel() for k in keys), np.arange(n) * (n + 1)]))
    rows = np.repeat(np.arange(n), np.diff(pattern.indptr))
    assert np.array_equal(rows * n + pattern.indices, known)
    assert np.array_equal(pattern.indices[pattern.diagonal], np.arange(n))
    for slots, expected in zip(pattern.slots, keys, strict=True):
        assert slots.shape == expected.shape and np.array_equal(known[slots], expected)


def test_product_and_blocks_are_those_of_the_matrix(box):
    mesh = box([2, 2, 1], [1, 1, 1])
    pattern = pattern_of(mesh.tetrahedra, len(mesh.nodes))
    random = np.random.default_rng(0)
    values = random.normal(size=(len(pattern.indices), 3, 3))
    matrix, x = pattern.matrix(values), random.normal(size=(len(mesh.nodes), 3))
    assert np.abs(product(matrix)(x).ravel() - matrix.toarray() @ x.ravel()).max() < 1e-13
    part = pattern.matrix(np.where(random.uniform(size=len(values)) < 0.3, 1.0, 0.0)[:, None, None] * values)
    for sparse in (part.tocsr(), part.tocoo(), part):
        assert np.array_equal(pattern.matrix(pattern.blocks(sparse)).toarray(), part.toarray())


def test_without_elements_there_is_the_diagonal_alone():
    pattern = shared_pattern([], 5)
    assert np.array_equal(pattern.matrix(np.tile(np.eye(3), (5, 1, 1))).toarray(), np.eye(15))
    assert pattern.slots == () and np.array_equal(pattern.diagonal, np.arange(5))
