"""Coarse samples of paper 1's protocol are the fine response at the coarse nodes, and nothing is simulated."""

import numpy as np
import pytest

from palpate.benchmark.static_responses import load_subsampled, save_subsampled, subsample
from palpate.errors import InputError


def test_coarse_nodes_move_as_the_fine_nodes_in_their_places(slab):
    """A field that is a known function of the place is the same function of the coarse nodes' places."""

    def moved(x):
        return np.stack([x[:, 1] ** 2, np.sin(9.0 * x[:, 2]), x[:, 0] * x[:, 1]], axis=1)

    fine = np.array([moved(slab.fine.nodes), 2.5 * moved(slab.fine.nodes)])
    found = subsample(slab, fine)
    assert found.shape == (2, len(slab.coarse.nodes), 3)
    assert np.array_equal(found[0], moved(slab.coarse.nodes))
    assert np.array_equal(found[1], 2.5 * found[0])


def test_three_nodes_by_their_numbers(slab):
    fine = np.arange(slab.fine.nodes.size, dtype=float).reshape(1, -1, 3)
    found = subsample(slab, fine)
    for node, expected in ((0, [0.0, 1.0, 2.0]), (10, [30.0, 31.0, 32.0]), (44, [132.0, 133.0, 134.0])):
        place = slab.coarse.nodes[node]
        assert np.array_equal(slab.fine.nodes[node], place) and found[0, node].tolist() == expected
    assert len(slab.coarse.nodes) == 45


def test_responses_of_another_mesh_are_refused(slab):
    with pytest.raises(InputError, match=r"^slab: the fine responses have 45 nodes and the fine mesh \d+"):
        subsample(slab, np.zeros((2, 45, 3)))


def test_reads_what_was_written(tmp_path):
    moved = np.random.default_rng(0).normal(size=(3, 5, 3))
    save_subsampled(np.array([2, 0, 1]), moved, tmp_path / "coarse_paper.h5")
    sample, again = load_subsampled(tmp_path / "coarse_paper.h5")
    assert sample.tolist() == [2, 0, 1] and np.array_equal(again, moved)
    assert [path.name for path in tmp_path.iterdir()] == ["coarse_paper.h5"]
