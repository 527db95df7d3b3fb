"""Block patterns against a dense assembly."""

import numpy as np

from palpate.linalg.block_pattern import hold, pattern_of


def test_pattern_puts_element_blocks_where_they_belong(box):
    mesh = box([2, 1, 1], [1, 1, 1])
    n = len(mesh.nodes) + 1  # one node without elements
    pattern = pattern_of(mesh.tetrahedra, n)
    blocks = np.random.default_rng(0).normal(size=(*mesh.tetrahedra.shape, 4, 3, 3))
    values = np.zeros((len(pattern.indices), 3, 3))
    np.add.at(values, pattern.slots[0], blocks)
    dense = np.zeros((n, 3, n, 3))
    for element, block in zip(mesh.tetrahedra, blocks, strict=True):
        for a in range(4):
            for b in range(4):
                dense[element[a], :, element[b], :] += block[a, b]
    assert np.abs(pattern.matrix(values).toarray() - dense.reshape(3 * n, 3 * n)).max() < 1e-14
    assert np.array_equal(pattern.indices[pattern.diagonal], np.arange(n))
    assert len(pattern.indices) == n + 2 * len(mesh.edges)


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
