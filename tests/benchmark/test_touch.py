"""Touches, their truth, and how models are measured on them."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.touched_pad import *  # noqa: F403
from fixtures.touched_pad import BALL

from palpate.benchmark.measuring import measure, tables
from palpate.benchmark.model import LeftOut
from palpate.benchmark.touch import (
    TouchErrors,
    choose_touches,
    given_touches,
    patch_of,
    places_to_touch,
    touch_errors,
    touches_of,
)
from palpate.benchmark.touch_measure import TOUCH, Touches, penetration, touch_settings, truth_rows
from palpate.benchmark.touch_mesh import TouchedMeshes
from palpate.benchmark.touch_truth import truth_of_touches
from palpate.errors import InputError
from palpate.models.touch import fem, modes
from palpate.studies.touch.settings import Families, Given


def test_the_truth_is_known_to_less_than_coarse_elements_are_wrong(touch_case, touches, touch_truth):
    assert touch_truth.believed.all()
    own = {name: column for name, column in zip(TouchErrors._fields, touch_truth.own.T, strict=True)}
    assert (own["force_error"] < 0.02).all() and (own["rmse_of_peak"] < 0.005).all()
    coarse = fem.online(touch_case, order=1, level=1).respond(touches[0])
    found = touch_errors(coarse, touch_truth.answer(0), patch_of(touch_case.body, touches[0]))
    assert found.force_error > 0.1 and found.rmse_of_peak > 0.01


@pytest.mark.slow
def test_a_finer_mesh_than_the_truths_is_within_its_own_error(touch_case, touches, touch_truth):
    """Twice the elements along the contact's radius, at the place only."""
    meshes = TouchedMeshes(touch_case.body)
    level = meshes.level_for(touches[0], 4.0)
    finer = meshes.around(touches[0], 1, level).answer(1e-4)[0]
    patch = patch_of(touch_case.body, touches[0])
    found, own = touch_errors(finer, touch_truth.answer(0), patch), TouchErrors(*touch_truth.own[0])
    assert abs(found.force_error) < 2.0 * own.force_error + 0.002


@pytest.mark.parametrize(("held", "level"), [(2, 3), (3, 2)])
def test_the_size_of_a_mesh_is_known_before_it_is_made(pad, touches, held, level):
    meshes = TouchedMeshes(pad)
    made, (nodes, tetrahedra) = meshes.around(touches[0], held, level).body, meshes.size(touches[0], held, level)
    assert tetrahedra == pytest.approx(len(made.levels[-2].tetrahedra), rel=0.15)
    assert nodes == pytest.approx(len(made.fine.nodes), rel=0.1)


def test_a_truth_says_its_size_first_and_is_refused_where_memory_lacks(pad, touches):
    said = []
    with pytest.raises(InputError, match=r"bodies\.pad, sphere 20 mm: .* takes 0\.\d GB of memory, of which 0\.2 GB"):
        truth_of_touches(pad, touches, say=said.append, free_mb=200.0)
    assert len(said) == 1 and " nodes in " in said[0]


def test_errors_have_a_sign(touch_truth):
    true = touch_truth.answer(0)
    harder = true._replace(force_n=1.3 * true.force_n, area_m2=0.9 * true.area_m2)
    found = touch_errors(harder, true, np.ones(len(true.displacement), dtype=bool))
    assert found.force_error == pytest.approx(0.3) and found.contact_area_error == pytest.approx(-0.1)
    assert found.rmse_of_peak == 0.0


def test_places_are_drawn_with_depths_and_tilts(pad):
    table = choose_touches(pad, BALL, 6, (0.2, 0.3), 3, lambda touch: True)
    assert len(table) == 6 and np.isin(table["node"], places_to_touch(pad)).all()
    assert table["depth_m"].between(0.2 * BALL.radius_m, 0.3 * BALL.radius_m).all()
    cosines = [-touch.direction @ pad.fine.normals[touch.node] for touch in touches_of(BALL, table)]
    assert np.allclose(cosines[::2], 1.0) and all(np.sqrt(0.5) - 1e-9 <= c < 1.0 for c in cosines[1::2])


def test_what_a_body_does_not_bear_is_lowered_or_left(pad):
    with pytest.warns(UserWarning, match="less deep"):
        table = choose_touches(pad, BALL, 3, (0.3, 0.3), 3, lambda touch: touch.depth_m < 0.005)
    assert (table["depth_m"] < 0.005).all() and (table["asked_m"] == 0.3 * BALL.radius_m).all()
    with pytest.raises(InputError, match="no place bears"):
        choose_touches(pad, BALL, 3, (0.3, 0.3), 3, lambda touch: False)


def test_measured_rows_have_errors_times_and_failures(touch_case, touches, touch_truth):
    case = replace(touch_case, grid=Families(fem={"levels": [{"order": 1, "level": 1}], "local": []}))
    kind = Touches(case, touches, touch_truth)
    samples, settings = tables(kind, *measure(kind, touch_settings(case, "fem", fem.__name__), 2, 1.0))
    assert list(settings) == TOUCH.columns and len(samples) == 2
    row = settings.iloc[0]
    assert row["failures"] == 0 and row["online_median_s"] > 0.0
    assert row["force_error"] == pytest.approx(samples["force_error"].mean())
    assert row["force_error_p95"] >= abs(samples["force_error"]).min()
    assert samples["stiffness_error"].between(-0.9, 3.0).all()
    own = truth_rows(case, touches, touch_truth)[1].iloc[0]
    assert own["force_error"] == pytest.approx(touch_truth.own[:, TouchErrors._fields.index("force_error")].mean())


def test_penetration_is_that_of_the_deepest_node(touch_case, touches, touch_truth):
    true = touch_truth.answer(0)
    still = true._replace(displacement=np.zeros_like(true.displacement))
    assert penetration(touch_case, touches[0], still) == pytest.approx(1.0, rel=1e-6)
    assert penetration(touch_case, touches[0], true) < 0.02


def test_touches_of_a_config_are_at_the_nearest_node(pad, middle):
    given = [
        Given(body="pad", at_m=[0.041, 0.04, 0.045], depths_m=[0.001, 0.002]),
        Given(body="pad", at_m=[0.04, 0.04, 0.04], direction=[0.0, 1.0, -1.0], depths_m=[0.003]),
    ]
    table = given_touches(pad, BALL, given)
    assert list(table["node"]) == [middle] * 3 and list(table["depth_m"]) == [0.001, 0.002, 0.003]
    ways = [touch.direction for touch in touches_of(BALL, table)]
    assert np.allclose(ways[0], [0.0, 0.0, -1.0]) and np.allclose(ways[2], [0.0, np.sqrt(0.5), -np.sqrt(0.5)])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"at_m": [4.0, 0.04, 0.04]}, "touch.at[0].at_m is 3.92 m off the surface of pad"),
        ({"at_m": [0.04, 0.04, 0.0]}, "touch.at[0].at_m is where pad is held"),
        ({"depths_m": [0.001, 0.041]}, "touch.at[0].depths_m has 0.041, and pad is 0.04 m thick along that way"),
        ({"direction": [0.0, 0.0, 1.0]}, "touch.at[0].direction points out of pad there"),
    ],
)
def test_a_touch_that_is_none_is_refused(pad, given, said):
    usual = {"body": "pad", "at_m": [0.04, 0.04, 0.04], "depths_m": [0.001]}
    with pytest.raises(InputError) as refused:
        given_touches(pad, BALL, [Given(**usual | given)])
    assert said in str(refused.value)


def test_what_no_mesh_resolves_has_no_truth(pad, middle):
    given = Given(body="pad", at_m=pad.fine.nodes[middle].tolist(), depths_m=[1e-9])
    shallow = touches_of(BALL, given_touches(pad, BALL, [given]))
    with pytest.warns(UserWarning, match="1 of 1 touches have no truth"):
        truth = truth_of_touches(pad, shallow)
    assert not truth.believed.any() and np.isnan(truth.force).all() and "too little for any mesh" in truth.rejected[0]


def test_tissue_that_sticks_is_harder_to_press(touch_case, touches):
    local = touch_case.grid.fem.local[0]
    forces = []
    for sticks in (False, True):
        ball = replace(BALL, sticks=sticks)
        case = replace(touch_case, instrument=ball, kept={})
        forces.append(fem.online(case, **dict(local)).respond(replace(touches[0], instrument=ball, poses={})).force_n)
    assert 1.002 < forces[1] / forces[0] < 1.1
    with pytest.raises(LeftOut):
        modes.online(case, **dict(local))
