"""What a model may see, and what using it costs."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.sparse import eye_array
from scipy.sparse.linalg import splu

from palpate.benchmark.model import checked, distinct, held_mb, training_counts
from palpate.errors import InputError, NotConverged
from palpate.models.kinds import FEM, DetailCorrection, LinearFEM


@pytest.fixture
def case(slab_case):
    return replace(slab_case[0], used={})


def test_no_test_sample_is_in_a_case(slab_case):
    case, test, numbers = slab_case
    assert not set(case.use_training().contact) & set(test.contact)
    assert len(numbers) == len(test.contact) == 6


def test_what_is_used_is_charged_once_and_looking_costs_nothing(case):
    assert case.database.fine.any() and case.response.fine.any() and case.used == {}
    assert case.meshes.contact.size == 0 and case.n_training == 12 and case.used == {}
    for _ in range(2):
        assert case.use_training().fine.shape == (12, case.n_surface, 3)
    assert case.used == {"training": 24.0}
    assert case.use_compliance() is case.response and case.response.seconds > 0
    assert case.used == {"training": 24.0, "compliance": case.response.seconds}
    with pytest.raises(InputError, match="no compliance"):
        replace(case, response=None).use_compliance()


def test_fewer_samples_cost_less_and_are_part_of_more(slab_case, case):
    few, more = case.first(4), case.first(9)
    assert few.n_training == 4 and more.n_training == 9
    assert {tuple(f) for f in few.database.force} <= {tuple(f) for f in more.database.force}
    assert few.use_training() is few.database and case.used == {"training": 8.0}
    db = slab_case[1]
    part = db.take(np.array([4, 1]))
    assert np.array_equal(part.fine, db.fine[[4, 1]]) and np.array_equal(part.coarse_live, db.coarse_live[[4, 1]])
    assert part.nodes_fine_surface is db.nodes_fine_surface


def test_settings_as_text_and_shares_of_the_samples_as_whole_numbers(case):
    told = DetailCorrection(coarse="2 iterations", samples=0, turned=False)
    assert (LinearFEM().text, told.text) == ("default", "coarse=2 iterations, samples=0, turned=false")
    assert distinct([FEM(order=order, tolerance=1e-3) for order in (1, 2)]) == [FEM(order=1, tolerance=1e-3)]
    assert training_counts(case, [0.25, 0.4, 0.6, 0.8, 1.0]) == [4, 5, 7, 10, 12]
    assert training_counts(case, [1.0, 0]) == [0, 12]


def test_answers_are_checked():
    answer = np.zeros((4, 3))
    assert checked(answer, 4) is answer
    with pytest.raises(InputError, match=r"^mine: the answer has the shape \(4, 3\)"):
        checked(answer, 5, "mine")
    with pytest.raises(InputError, match="no array of numbers"):
        checked("answer", 5)
    answer[1, 2] = np.nan
    with pytest.raises(NotConverged, match="not finite"):
        checked(answer, 4)


ONE = np.zeros(125_000)  # a megabyte


class Holds:
    def __init__(self, **what):
        vars(self).update(what)


def test_arrays_and_factors_are_found_wherever_they_are_and_count_once():
    one, shared = ONE, Holds(x=ONE)
    shared.itself = shared
    closed_over = lambda: one  # noqa: E731
    for held in (ONE, [ONE], {"a": (ONE,)}, Holds(inner=shared), partial(print, ONE), closed_over, ONE[10:20]):
        assert held_mb(held) == 1.0
    assert held_mb([shared, shared, ONE[:10], ONE.reshape(5, -1)]) == 1.0
    assert held_mb([np, print, Holds, "text", 3, None]) == 0.0
    matrix = eye_array(1000, format="csc")
    assert held_mb(matrix) == (matrix.data.nbytes + matrix.indices.nbytes + matrix.indptr.nbytes) / 1e6
    assert held_mb(splu(matrix)) >= 12 * 1000 / 1e6
