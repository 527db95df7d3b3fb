"""Springs come apart where they are cut, and relaxed elements end where elements do."""

import numpy as np
import pytest
from fixtures.cut_cases import answer, check_severed

from palpate.benchmark.cut_truth import pull_errors
from palpate.bodies.cutting.ways import SPLIT_FACES, VIRTUAL_NODES
from palpate.models.cut.elements import online
from palpate.models.cut.opened import before_cut
from palpate.models.relaxed import CutRelaxed
from palpate.models.springs.mass_spring import DELETED, CutSprings


@pytest.mark.parametrize("at", [0.05, 0.0537])
@pytest.mark.parametrize("way", [DELETED, SPLIT_FACES, VIRTUAL_NODES])
def test_severed_springs_follow_their_hook_without_a_force(severed, way, at):
    case = severed(at)
    check_severed(case, answer(CutSprings(case, level=1, way=way, iterations=100)))


def test_springs_pull_before_the_cut_as_quadratic_elements_do(opening):
    springs = CutSprings(opening, level=0, way=SPLIT_FACES, iterations=100)
    assert springs.pull().force.sum() == pytest.approx(before_cut(opening, 0)[1].sum(), rel=0.02)


@pytest.mark.parametrize(
    "way", [SPLIT_FACES, *(pytest.param(way, marks=pytest.mark.slow) for way in (DELETED, VIRTUAL_NODES))]
)
def test_springs_open_along_the_cut(opening, way):
    found = answer(CutSprings(opening, level=1, way=way, iterations=100))
    wide = found.opening @ [0.0, 1.0, 0.0]
    assert (wide[1:-1] > 0.0005).all()
    assert wide[len(wide) // 2] > 1.3 * wide[0]


CONVERGED = {
    "xpbd": {"step": 2.0, "steps": 100, "iterations": 3},
    "projective_dynamics": {"iterations": 30, "memory": 5},
    "vertex_block_descent": {"sweeps": 100, "radius": 0.95},
}


@pytest.mark.parametrize("method", CONVERGED)
def test_relaxed_elements_end_where_elements_do(opening, method):
    right = answer(online(opening, level=0, way=VIRTUAL_NODES))
    errors = pull_errors(answer(CutRelaxed(method, opening, level=0, **CONVERGED[method])), right)
    assert errors[0] < 0.01
    assert errors[2] < 0.02
    assert np.isfinite(errors).all()
