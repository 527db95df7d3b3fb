"""Elements on a cut level: what is severed moves by itself, what is not answers as before, and levels converge."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.cut_cases import answer

from palpate.benchmark.cut_truth import Hook, pull_errors
from palpate.bodies.cutting.ways import WAYS
from palpate.errors import NotConverged
from palpate.models.cut.elements import CONFORM, online
from palpate.solvers.grasping import GraspedPatch


@pytest.fixture(scope="module")
def quadratic(opening):
    return answer(online(opening, level=1, way=CONFORM))


@pytest.mark.parametrize(
    ("way", "surface", "wide"), [(WAYS[0], 0.06, 0.4), (WAYS[1], 0.05, 0.15), (WAYS[2], 0.05, 0.15)]
)
def test_linear_elements_open_as_quadratic_ones_do(opening, quadratic, way, surface, wide):
    errors = [pull_errors(answer(online(opening, level=n, way=way)), quadratic) for n in (0, 1)]
    assert errors[1][0] < min(surface, errors[0][0])
    assert errors[1][1] < min(wide, errors[0][1])


def test_a_hook_between_nodes_is_refused(opening):
    fine = opening.body.fine
    between = fine.triangles[(fine.triangles >= len(opening.body.coarse.nodes)).all(axis=1)][:1]
    case = replace(opening, hooks=[Hook(GraspedPatch(fine.nodes[between]), np.ones(3))])
    with pytest.raises(NotConverged, match="no node"):
        answer(online(case, level=0, way=WAYS[0]))
