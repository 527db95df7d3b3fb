"""Elements on a cut level: what is severed moves by itself, what is not answers as before, and levels converge."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.cut_cases import answer, check_severed, hook

from palpate.benchmark.cut_truth import Hook, pull_errors
from palpate.bodies.cutting.cut import blade
from palpate.bodies.cutting.ways import WAYS
from palpate.errors import NotConverged
from palpate.models.cut.elements import CONFORM, Nodes, online
from palpate.solvers.grasping import GraspedPatch, Grasping


@pytest.mark.parametrize("at", [0.05, 0.05 + 1e-9, 0.0537])
@pytest.mark.parametrize("way", WAYS)
def test_a_bar_that_is_severed_follows_its_hook_without_a_force(severed, way, at):
    case = severed(at)
    check_severed(case, answer(online(case, level=1, way=way)))


@pytest.mark.parametrize("way", WAYS)
def test_what_is_cut_free_and_not_hooked_stays_where_it_is(severed, way):
    case = severed(0.0537, (0.995, 0.0998, 0.0))
    case = replace(case, hooks=[hook(case.body, [0.03, 0.01, 0.02], [0.0, 0.0, 0.001])])
    found = answer(online(case, level=1, way=way))
    places = case.body.fine.nodes[case.body.fine.surface]
    assert not found.displacement[case.cuts[0].across(places) > 0.001].any()
    assert found.force[0] > 0.0


@pytest.mark.parametrize("way", WAYS)
def test_a_cut_without_area_changes_no_answer(slab, opening, way):
    path = np.array([[0.031, 0.0523, 0.04], [0.0672, 0.0416, 0.04]])
    pull = opening.hooks[0]
    case = replace(opening, cuts=[blade(slab.fine, path, np.array([0.0, 0.0, -1.0]), 0.0)], hooks=[pull])
    found = answer(online(case, level=0, way=way))
    problem = Grasping(slab, 0, 1, Nodes(np.empty((0, 3, 3)), pull.patch.nodes_of(slab.coarse)))
    depth = np.linalg.norm(pull.shift_m)
    (state,) = problem.push(pull.shift_m / depth, [depth], 1e-9)
    same = slab.fine.surface < len(slab.coarse.nodes)
    moved = (state.x - slab.coarse.nodes)[slab.fine.surface[same]]
    assert np.allclose(found.displacement[same], moved, rtol=0.0, atol=1e-6 * np.abs(moved).max())


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
