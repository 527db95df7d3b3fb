"""Touches are asked and scored as those of palpate's own models: displacement, force, stiffness and overlap."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.touched_pad import *  # noqa: F403

from palpate.benchmark.measuring import measure, tables
from palpate.benchmark.settings import TouchTruthSettings
from palpate.benchmark.touch import TouchTruth
from palpate.benchmark.touch_measure import Touches, touch_settings
from palpate.benchmark.touch_truth import truth_of_touches
from palpate.effects.instrument import Instrument, Pose
from palpate.errors import InputError
from palpate.exchange import touches as asking
from palpate.exchange.ask import readme
from palpate.exchange.asked_body import pictures
from palpate.exchange.folder import read, write
from palpate.exchange.judging import score_answers
from palpate.models.touch import fem

pytestmark = pytest.mark.slow

RUNS = [{"order": 1, "level": 0}, {"order": 1, "level": 1}, {"order": 2, "level": 0}]


@pytest.fixture(scope="module")
def touch_truth(pad, touches) -> TouchTruth:
    """A truth of few elements: here it only has to be the same inside and outside."""
    return truth_of_touches(
        pad, touches, settings=TouchTruthSettings(along_radius=1.0, finest=1, most_force_error=0.5, most_error=0.2)
    )


@pytest.fixture(scope="module")
def asked(touch_case, touches, touch_truth, tmp_path_factory):
    """The touches as a folder of questions, written and read."""
    questions = asking.questions_of(touch_case.body, touch_truth.sample, touches)
    questions = replace(questions, truth=asking.truth_arrays(touch_truth, np.arange(len(touches))))
    folder = tmp_path_factory.mktemp("touches")
    pages = {"README.md": readme(questions, touch_case.body.material.law)}
    write(questions, folder / "q", pages | pictures(touch_case.body))
    text = pages["README.md"].decode()
    assert "{" not in text.partition("```python")[0] and "a ball of radius R" in text
    compile(text.split("```python\n")[1].split("```")[0], "README.md", "exec")
    return read(folder / "q")


@pytest.fixture(scope="module")
def inside(touch_case, touches):
    """Answers of finite elements inside, at the whole depth and before it, as a file has them."""
    found = {
        "engine": np.array("elements"), "version": np.array("1"), "hardware": np.array("here"),
        "law": np.array("corotational"), "settings": np.array([f"order {r['order']} level {r['level']}" for r in RUNS]),
        "converged": np.ones(3, dtype=bool),
    }  # fmt: skip
    for i, run in enumerate(RUNS):
        solver = fem.online(touch_case, **run)
        whole = [solver.respond(touch) for touch in touches]
        before = [solver.respond(touch.before) for touch in touches]
        found |= {
            f"setting_{i}/displacement_m": np.array([each.displacement for each in whole]),
            f"setting_{i}/force_n": np.array([each.force_n for each in whole]),
            f"setting_{i}/force_before_n": np.array([each.force_n for each in before]),
            f"setting_{i}/area_m2": np.array([each.area_m2 for each in whole]),
            f"setting_{i}/seconds": np.ones(len(touches)), f"setting_{i}/preparation_s": np.array(0.1),
            f"setting_{i}/memory_mb": np.array(1.0),
        }  # fmt: skip
    return found


def scored(asked, answers, path):
    np.savez(path, digest=np.array(asked.digest), **answers)
    return score_answers(path, asked, asked.truth)


def test_a_file_is_scored_as_the_same_model_inside(
    touch_case, touches, touch_truth, asked, inside, tmp_path, monkeypatch
):
    """Errors of surface, dent, force, stiffness and area, and overlap, agree to rounding."""
    monkeypatch.setattr(fem, "settings", lambda case: RUNS)
    kind = Touches(touch_case, touches, touch_truth)
    _, known = tables(kind, *measure(kind, touch_settings(touch_case, "fem", fem.__name__), 1, 0.0))
    found = scored(asked, inside, tmp_path / "a.npz").settings
    columns = [
        "rmse_of_peak",
        "patch_rms_of_peak",
        "patch_max_of_peak",
        "max_of_peak",
        "force_error",
        "stiffness_error",
    ]
    for column in [*columns, "contact_area_error", "penetration_of_depth", "force_error_median", "rmse_of_peak_p95"]:
        assert found[column].to_numpy() == pytest.approx(known[column].to_numpy(dtype=float), rel=1e-6, abs=1e-9), (
            column
        )
    assert (found["failures"] == 0).all() and found["scene"].tolist() == known["scene"].tolist()


def test_poses_are_those_of_first_touch(touch_case, asked):
    """The gap to the body at rest is zero at the pose that is asked about, and its axes are orthonormal."""
    loads, points = asked.arrays["loads"], asked.points
    instrument = Instrument(**asked.info["instrument"])
    for tip, axes in zip(loads["tip_m"], loads["axes"], strict=True):
        gaps, _ = Pose(instrument, tip, axes).gaps(points)
        assert gaps.min() > -1e-9 and gaps.min() < 0.01 * instrument.radius_m + 0.1 * touch_case.body.fine.size
        assert np.allclose(axes @ axes.T, np.eye(3))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"setting_1/force_n": None}, r"setting_1/force_n is missing"),
        ({"setting_1/force_n": lambda f: -f}, r"force_n is below 0 in every touch; give the force on the body"),
        ({"setting_1/force_n": lambda f: 1000 * f}, r"force_n is \d+ times the truth, as if in mN; give N"),
        ({"setting_1/displacement_m": lambda u: 1000 * u}, r"as if in millimetres"),
    ],
)
def test_faulty_forces_have_one_sentence(asked, inside, tmp_path, change, said):
    answers = dict(inside)
    for name, make in change.items():
        value = answers.pop(name)
        if make is not None:
            answers[name] = make(value)
    with pytest.raises(InputError, match=said):
        scored(asked, answers, tmp_path / "a.npz")


def test_what_may_be_left_out_is_empty_and_failures_count(asked, inside, tmp_path):
    answers = {name: value.copy() for name, value in inside.items() if "before" not in name and "area" not in name}
    answers["setting_0/failed"] = np.arange(asked.count) == 0
    for name in ("displacement_m", "force_n"):
        answers[f"setting_0/{name}"][0] = np.nan
    found = scored(asked, answers, tmp_path / "a.npz").settings
    assert found["stiffness_error"].isna().all() and found["contact_area_error"].isna().all()
    assert found["failures"].tolist() == [1, 0, 0] and np.isfinite(found["force_error"]).all()


def test_a_grasp_cannot_be_asked(touch_case, touches):
    grasp = replace(touches[0], instrument=Instrument("grasp", 0.01), poses={})
    with pytest.raises(InputError, match="a grasp has no shape"):
        asking.questions_of(touch_case.body, np.array([0]), [grasp])
