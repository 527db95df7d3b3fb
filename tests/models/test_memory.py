"""Every array is found, and counted once."""

from functools import partial

import numpy as np
from scipy.sparse import eye_array
from scipy.sparse.linalg import splu

from palpate.benchmark.model import held_mb

ONE = np.zeros(125_000)  # a megabyte


class Holds:
    def __init__(self, **what):
        vars(self).update(what)


def test_arrays_are_found_wherever_they_are():
    one = ONE

    def closed_over():
        return one

    for held in (ONE, [ONE], {"a": (ONE,)}, Holds(inner=Holds(x=ONE)), partial(print, ONE), closed_over, ONE[10:20]):
        assert held_mb(held) == 1.0


def test_what_is_shared_counts_once():
    shared = Holds(x=ONE)
    assert held_mb([shared, shared, ONE[:10], ONE.reshape(5, -1)]) == 1.0


def test_a_sparse_matrix_and_its_factor():
    matrix = eye_array(1000, format="csc")
    assert held_mb(matrix) == (matrix.data.nbytes + matrix.indices.nbytes + matrix.indptr.nbytes) / 1e6
    assert held_mb(splu(matrix)) >= 12 * 1000 / 1e6


def test_code_weighs_nothing():
    assert held_mb([np, print, Holds, "text", 3, None]) == 0.0


def test_a_loop_ends():
    loop = Holds(x=ONE)
    loop.itself = loop
    assert held_mb(loop) == 1.0
