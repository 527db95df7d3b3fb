"""A small slab is cut and measured, and what is asked of bodies is refused where it cannot be."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.benchmark.cut_truth import CutTruth
from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.settings import Box
from palpate.bodies.simple_shapes import box
from palpate.errors import InputError
from palpate.models.cut import linear
from palpate.models.cut.tried import MODELS
from palpate.run.settings import defaults
from palpate.studies.cut import measure
from palpate.studies.cut.settings import Pull, check

ENTRY = {
    "body": "slab",
    "cut": {"path_m": [[0.03, 0.049, 0.04], [0.07, 0.052, 0.04]], "depth_m": 0.012},
    "hooks": [
        {"at_m": [0.05, 0.025, 0.04], "radius_m": 0.013, "shift_m": [0.0, -0.003, 0.001]},
        {"at_m": [0.05, 0.075, 0.04], "radius_m": 0.013, "shift_m": [0.0, 0.003, 0.001]},
    ],
}
LINEAR = [{"level": 1, "update": True}, {"level": 1, "update": False}]
TRIED = {
    "fem": [{"level": 1, "way": "virtual_nodes"}, {"level": 0, "way": "removal"}],
    "linear_responses": LINEAR,
    "springs": [{"level": 0, "way": "deleted", "iterations": 5}, {"level": 2, "way": "deleted", "iterations": 5}],
    "enriched_responses": [{"level": 0, "order": 1}],
    "shape_matching": [{"level": 1, "mode": "linear", "clusters": "tetrahedra", "steps": 10}],
    "projective_dynamics": [{"level": 1, "iterations": 30, "memory": 5}],
}


@pytest.fixture(scope="module")
def case():
    mesh = box([0.1, 0.1, 0.04], [4, 4, 2])
    held = np.flatnonzero(mesh.nodes[:, 2] == 0.0)
    return measure.asked(nest("slab", mesh, 1, held, Material(3000.0, 0.3, 1000.0)), Pull(**ENTRY))


@pytest.fixture(scope="module")
def truth(case):
    """As if elements with virtual nodes told it."""
    model = MODELS["fem"](case, **TRIED["fem"][0])
    model.cut(model.case.cuts)
    own = np.array([0.001, 0.01, 0.02])
    return CutTruth(model.pull(), own, 2.0, 1.9, -0.0, 0.8, 12.0, 1000, 1.0, "")


@pytest.fixture(scope="module")
def tables(case, truth):
    return measure.measure_models("slab_cut", case, truth, 1, 0.01, tried=TRIED)


def test_hooks_grasp_nodes_of_every_level(case):
    for hook in case.hooks:
        counts = [len(hook.patch.nodes_of(mesh)) for mesh in case.body.levels]
        assert counts[0] >= 1 and counts[1] > counts[0]
    assert len(case.places) == 9


def test_errors_are_against_the_truth_and_beside_its_own(tables):
    cut, _ = tables
    assert len(cut) == 8  # a level that the body has not is left out
    same, removed = cut.iloc[0], cut.iloc[1]
    assert same[list(measure.ERRORS)].tolist() == [0.0, 0.0, 0.0] and same["lost_share"] == pytest.approx(0.0)
    assert cut[[f"own_{name}" for name in measure.ERRORS]].to_numpy() == pytest.approx(
        np.tile([0.001, 0.01, 0.02], (8, 1))
    )
    assert removed["lost_share"] > 0.001 and removed["surface_error"] > 0.01
    follows = cut[cut["model"] == "projective_dynamics"].iloc[0]  # converges to the same elements
    assert 0.0 < follows["surface_error"] < 0.02
    updated, anew = (cut[cut["setting"] == f"level=1, update={word}"].iloc[0] for word in ("true", "false"))
    assert updated["surface_error"] == pytest.approx(anew["surface_error"], rel=1e-3)
    assert (cut["first_median_s"] > cut["change_median_s"]).all() and (cut["calls"] == 1).all()
    assert (cut["failure"] == "").all()
    soon = cut["first_median_s"] <= measure.SOON_S
    assert (cut["step_max_s"].notna() == soon).all() and soon.any()
    assert (cut["memory_mb"] > 0.01).all()


def test_what_cannot_follow_says_why(case, truth, monkeypatch):
    monkeypatch.setattr(linear, "LARGEST", 100)
    tried = {"linear_responses": LINEAR[:1]}
    cut, opening = measure.measure_models("slab_cut", case, truth, 1, 0.01, tried=tried)
    assert "the compliance of" in cut["failure"].iloc[0] and np.isnan(cut["first_median_s"].iloc[0])
    assert (opening["model"] == "truth").all()


def test_openings_are_told_at_places_along_the_cut(case, truth, tables):
    _, opening = tables
    known = opening[opening["model"] == "truth"]
    assert known["opening_m"].to_numpy() == pytest.approx(np.linalg.norm(truth.pulled.opening, axis=1))
    assert known["along_m"].iloc[-1] == pytest.approx(0.8 * np.hypot(0.04, 0.003))
    assert len(opening) == 9 * 9  # of eight settings and the truth


def test_a_truth_that_is_rejected_judges_no_model(case, truth):
    rejected = replace(truth, rejected="the lips close")
    cut, _ = measure.measure_models("slab_cut", case, rejected, 1, 0.01, tried={"fem": TRIED["fem"][:1]})
    assert np.isnan(cut["surface_error"].iloc[0]) and cut["first_median_s"].iloc[0] > 0.0
    row = measure.truth_row("slab_cut", case, rejected).iloc[0]
    assert row["rejected"] == "the lips close" and row["opening_error"] == 0.01


def test_a_cut_of_a_body_that_is_none_is_refused():
    bar = Box(sizes_m=[0.1, 0.1, 0.1], divisions=[2, 2, 2], young_pa=1e3, poisson=0.3)
    bodies = {"bar": bar, "slab": bar.but(refinements=1)}
    for cuts, said in (
        ({}, "my.yaml: cut.cuts is empty"),
        ({"mine": ENTRY | {"body": "slap"}}, "my.yaml: cut.cuts.mine.body names slap, which is unknown; did you mean"),
        ({"mine": ENTRY | {"body": "bar"}}, "my.yaml: cut.cuts.mine.body names bar, which is not refined"),
    ):
        with pytest.raises(InputError) as refused:
            check(SimpleNamespace(bodies=bodies, cut=defaults("cut", cuts=cuts)), Path("my.yaml"))
        assert str(refused.value).startswith(said)
