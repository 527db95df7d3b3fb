"""Elements on a cut level: what is severed moves by itself, what is not answers as before, and levels converge."""

import numpy as np
import pytest

from palpate.benchmark.cut_truth import Hook, mouth, pull_errors
from palpate.bodies.body import nest
from palpate.bodies.cutting.cut import Disc, blade
from palpate.bodies.cutting.ways import WAYS
from palpate.bodies.material import Material
from palpate.bodies.simple_shapes import box
from palpate.errors import NotConverged
from palpate.models.cut.elements import CONFORM, Nodes, online
from palpate.models.cut.opened import CutCase
from palpate.solvers.grasping import Grasping, Patch, patch_around

TISSUE = Material(3000.0, 0.3, 1000.0)
NO_PLACES = np.empty((0, 3))
UP = np.array([0.0, 0.0, 1.0])


def node_at(body, place):
    return body.fine.surface[np.linalg.norm(body.fine.nodes[body.fine.surface] - place, axis=1).argmin()]


def hook(body, place, shift, radius=0.013):
    return Hook(patch_around(body.levels[-1], node_at(body, place), radius), np.array(shift))


def bar():
    mesh = box([0.1, 0.02, 0.02], [10, 2, 2])
    return nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), TISSUE)


def slab():
    mesh = box([0.1, 0.1, 0.04], [8, 8, 4])
    return nest("slab", mesh, 1, np.flatnonzero(mesh.nodes[:, 2] == 0.0), TISSUE)


def answer(case, **setting):
    model = online(case, setting)
    model.cut()
    return model.pull()


@pytest.mark.parametrize("at", [0.05, 0.05 + 1e-9, 0.0537])
@pytest.mark.parametrize("way", WAYS)
def test_a_bar_that_is_severed_follows_its_hook_without_a_force(way, at):
    body = bar()
    cut = Disc(np.array([at, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), 1.0)
    case = CutCase(body, [cut], [hook(body, [0.1, 0.01, 0.01], [0.003, 0.0, 0.001])], NO_PLACES)
    found = answer(case, level=1, way=way)
    places = body.fine.nodes[body.fine.surface][:, 0]
    assert np.allclose(found.displacement[places < at], 0.0, atol=1e-9)
    assert np.allclose(found.displacement[places > at + 1e-6], [0.003, 0.0, 0.001], atol=1e-9)
    assert abs(found.force[0]) < 1e-9


@pytest.mark.parametrize("way", WAYS)
def test_what_is_cut_free_and_not_hooked_stays_where_it_is(way):
    body = bar()
    cut = Disc(np.array([0.0537, 0.0, 0.0]), np.array([1.0, 0.1, 0.0]), 1.0)
    case = CutCase(body, [cut], [hook(body, [0.03, 0.01, 0.02], [0.0, 0.0, 0.001])], NO_PLACES)
    found = answer(case, level=1, way=way)
    places = body.fine.nodes[body.fine.surface]
    assert not found.displacement[cut.across(places) > 0.001].any()
    assert found.force[0] > 0.0


@pytest.mark.parametrize("way", WAYS)
def test_a_cut_without_area_changes_no_answer(way):
    body = slab()
    path = np.array([[0.031, 0.0523, 0.04], [0.0672, 0.0416, 0.04]])
    pull = hook(body, [0.05, 0.075, 0.04], [0.0, 0.003, 0.001])
    found = answer(CutCase(body, [blade(body.fine, path, -UP, 0.0)], [pull], NO_PLACES), level=0, way=way)
    nodes = pull.patch.nodes_of(body.coarse)
    problem = Grasping(body, 0, 1, Nodes(np.empty((0, 3, 3)), nodes))
    (state,) = problem.push(pull.shift_m / np.linalg.norm(pull.shift_m), [np.linalg.norm(pull.shift_m)], 1e-9)
    surface = np.arange(len(body.coarse.nodes))
    same = np.isin(body.fine.surface, surface)
    moved = (state.x - body.coarse.nodes)[body.fine.surface[same]]
    assert np.allclose(found.displacement[same], moved, rtol=0.0, atol=1e-6 * np.abs(moved).max())


@pytest.fixture(scope="module")
def opened():
    body = slab()
    cut = blade(body.fine, np.array([[0.025, 0.0512, 0.04], [0.075, 0.0488, 0.04]]), -UP, 0.015)
    hooks = [hook(body, [0.05, 0.05 + y, 0.04], [0.0, 0.15 * y, 0.001]) for y in (0.025, -0.025)]
    case = CutCase(body, [cut], hooks, mouth(body.fine, cut))
    return case, answer(case, level=1, way=CONFORM)


@pytest.mark.parametrize(
    ("way", "surface", "opening"), [(WAYS[0], 0.06, 0.4), (WAYS[1], 0.05, 0.15), (WAYS[2], 0.05, 0.15)]
)
def test_linear_elements_open_as_quadratic_ones_do(opened, way, surface, opening):
    case, right = opened
    errors = [pull_errors(answer(case, level=level, way=way), right) for level in (0, 1)]
    assert errors[1][0] < min(surface, errors[0][0])
    assert errors[1][1] < min(opening, errors[0][1])


def test_a_hook_between_nodes_is_refused(opened):
    case, _ = opened
    fine = case.body.fine
    between = fine.triangles[(fine.triangles >= len(case.body.coarse.nodes)).all(axis=1)][:1]
    small = CutCase(case.body, case.cuts, [Hook(Patch(fine.nodes[between]), UP)], case.places)
    with pytest.raises(NotConverged, match="no node"):
        answer(small, level=0, way=WAYS[0])
