"""The compliance that is updated by a cut is that of the cut body."""

import numpy as np
import pytest
from fixtures.cut_cases import answer

from palpate.benchmark.cut_truth import pull_errors
from palpate.benchmark.load import Refused
from palpate.bodies.cutting.ways import REMOVAL, SPLIT_FACES, VIRTUAL_NODES
from palpate.models.cut import elements
from palpate.models.cut.linear import online


@pytest.mark.slow
@pytest.mark.parametrize(("level", "way"), [(0, SPLIT_FACES), (0, VIRTUAL_NODES)])
def test_an_updated_compliance_answers_as_one_prepared_anew(opening, level, way):
    anew, updated = (answer(online(opening, level=level, way=way, update=u)) for u in (False, True))
    assert max(pull_errors(updated, anew)) < 2e-5  # the residual of the responses
    assert np.linalg.norm(anew.opening, axis=1).max() > 0.001


def test_small_pulls_are_answered_as_by_elements(opening):
    small = [hook._replace(shift_m=1e-3 * hook.shift_m) for hook in opening.hooks]
    case = type(opening)(opening.body, opening.cuts, small, opening.places)
    right = answer(elements.online(case, level=0, way=VIRTUAL_NODES))
    assert max(pull_errors(answer(online(case, level=0, way=VIRTUAL_NODES, update=True)), right)) < 2e-3


def test_removed_elements_are_refused(opening):
    with pytest.raises(Refused):
        online(opening, level=0, way=REMOVAL, update=True)
