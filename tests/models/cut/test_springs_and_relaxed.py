"""Springs come apart where they are cut, and relaxed elements end where elements do."""

import pytest
from fixtures.cut_cases import answer

from palpate.bodies.cutting.ways import SPLIT_FACES, VIRTUAL_NODES
from palpate.models.cut.opened import before_cut
from palpate.models.springs.mass_spring import DELETED, CutSprings


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
