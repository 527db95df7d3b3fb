"""Block patterns against a dense assembly."""

import numpy as np

from palpate.linalg.block_pattern import hold, pattern_of, product


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
