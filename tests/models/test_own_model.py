"""The example of docs/add-a-model.md works, and what is wrong with a file is said with its name."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fixtures.poked_bar import poked
from fixtures.touched_pad import *  # noqa: F403
from fixtures.touched_pad import BALL

import palpate as pp
from palpate.benchmark import measuring
from palpate.benchmark.measuring import tables
from palpate.benchmark.press_measure import measure, warn_unanswered
from palpate.benchmark.touch_measure import Touches
from palpate.comparison import ComparedCase, Comparison
from palpate.errors import InputError
from palpate.models.model_registry import model
from palpate.models.own_model import load_own, own_settings
from palpate.own_file import ANSWERS, answers
from palpate.run.settings import defaults
from palpate.setting_types import plain
from palpate.studies.dynamic.accuracy import measure as measure_motions
from palpate.studies.dynamic.accuracy import own_motions
from palpate.studies.dynamic.reference import reference
from palpate.studies.dynamic.settings import tried

DOCS = Path(__file__).parents[2] / "docs"
SOLVER = "class S:\n    memory_mb = 0.0\n    def respond(self, load):\n        %s\n"
MODEL = "class M:\n    %s\n    def prepare(self, case):\n        return S()\n"
NOTHING = SOLVER % "pass"


def test_the_example_is_measured_like_any_other_and_the_guide_shows_it(slab_case, slab_judge):
    case = slab_case[0]
    nearest = model("nearest", {"nearest": DOCS / "example_model.py"})
    samples, settings = measure(case, "nearest", nearest.tried(case, None), slab_judge, 6, 0.1)
    assert len(settings) == 5 and (settings["failures"] == 0).all() and len(samples) == 5 * 6
    assert settings["offline_s"].is_monotonic_increasing and (settings["offline_s"] > 4.0).all()
    assert settings["memory_mb"].is_monotonic_increasing
    assert samples.groupby("setting")["rmse_of_peak"].mean().min() < 0.4  # 0.55 if nothing moves
    assert samples["rmse_of_peak"].between(0.01, 1.5).all()
    assert (DOCS / "example_model.py").read_text() in (DOCS / "add-a-model.md").read_text()


def test_one_file_answers_presses_touches_and_a_motion_in_their_studies(
    slab_case, slab_judge, touch_case, touches, touch_truth, box
):
    file = str(DOCS / "example_of_all_kinds.py")
    assert answers(Path(file)) == list(ANSWERS)
    pressed = measure(slab_case[0], "own", [load_own("own", Path(file))], slab_judge, 2, 0.1)[1]
    own = own_settings("own", file, "touch", touch_case.body, "ball", BALL.radius_m, 1)
    kind = Touches(touch_case, touches, touch_truth, file)
    touched = tables(kind, *measuring.measure(kind, own, 2, 0.0))[1]
    scene = poked(box, frames=4)
    truth, grid = reference(scene, None, 0.1, 6), plain(defaults("dynamic").settings)
    moved = measure_motions(scene, None, truth, tried(grid, {}), ("none",), own={"own": file})[0]
    for table in (pressed, touched, moved[moved["model"] == "own"]):
        [row] = table.to_dict("records")
        assert (row["model"], row["failures"]) == ("own", 0) and 0.0 < row["rmse_of_peak"] < 0.7
    assert abs(touched["force_error"].item()) < 0.2  # Hertz on a pad as thick as the ball's radius twice
    assert pressed["law"].item() == touched["law"].item() == "linear"
    assert (DOCS / "example_of_all_kinds.py").read_text() in (DOCS / "add-a-model.md").read_text()


def test_a_model_is_in_no_study_whose_questions_it_cannot_answer(slab_case, slab_judge, tmp_path):
    (tmp_path / "mine.py").write_text(SOLVER.replace("respond", "touch") % "pass" + MODEL % "pass")
    with pytest.warns(UserWarning, match="mine is left out: what it prepares has no respond"):
        found = measure(slab_case[0], "mine", [load_own("mine", tmp_path / "mine.py")], slab_judge, 1, 0.1)
    assert not any(map(len, found))
    warn_unanswered("mine", found[1])


@pytest.mark.parametrize(
    ("frames", "said"),
    [
        ("return np.zeros((3, n, 3))", "frames"),
        ("return 3", "does not work"),
        ("yield from np.zeros((4, 3))", "shape"),
        ("yield from (1 / 0 for each in range(4))", r"\(line 7, ZeroDivisionError"),
    ],
)
def test_frames_that_are_none_of_a_motion_are_refused_by_name(tmp_path, box, frames, said):
    scene = poked(box, frames=4)
    text = "import numpy as np\nfrom palpate.benchmark.load import Answer\nclass M:\n    def prepare(self, case):\n"
    text += f"        return self\n    def move(self, motion, n={len(scene.body.fine.surface)}):\n        {frames}\n"
    (tmp_path / "mine.py").write_text(text)
    with pytest.raises(InputError, match=said) as caught:
        [one] = own_motions(scene, {"mine": str(tmp_path / "mine.py")}, 1)
        one.solver()
    assert "mine.py" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = ", "cannot be imported"),
        ("x = 1", r"has no class with prepare\(case\)"),
        (NOTHING + MODEL % "tried = lambda self, case: 3", "no list of such models"),
        ("class M:\n    def prepare(self, case):\n        return 3\n", "lacks respond"),
        (SOLVER % "return 1 / 0" + MODEL % "pass", r"\(line 4, ZeroDivisionError: "),
        (SOLVER % "return load.single()[1]" + MODEL % "pass", "shape"),
        (NOTHING + MODEL % "sees = 'force'", "sees is 'force'; give 'load' or 'deformation'"),
    ],
)
def test_a_bad_one_is_refused_by_name(tmp_path, slab_case, slab_judge, text, said):
    case = slab_case[0]
    file = tmp_path / "mine.py"
    file.write_text(text)
    with pytest.raises(InputError, match=said) as caught:
        measure(case, "mine", load_own("mine", file).tried(case, None), slab_judge, 1, 0.1)
    assert "mine.py" in str(caught.value)


def test_one_that_is_not_finite_has_failed(tmp_path, slab_case, slab_judge):
    case = slab_case[0]
    file = tmp_path / "mine.py"
    answer = f"import numpy\n        return numpy.full(({case.n_surface}, 3), numpy.nan)"
    file.write_text(SOLVER % answer + MODEL % "pass")
    samples, settings = measure(case, "mine", load_own("mine", file).tried(case, None), slab_judge, 1, 0.1)
    assert (samples["failure"] != "").all() and settings["failures"].item() == settings["samples"].item()
    failure = settings["failure"].item()
    assert "not finite" in failure and failure.startswith(f"{file}: ")


@pytest.fixture(scope="module")
def asked(slab_case, slab_judge):
    return ComparedCase(slab_case[0], slab_judge)


class Broken:
    """A model of a script that fails where its name says."""

    def __init__(self, where):
        self.where = where

    def prepare(self, case):
        return 1 / 0 if self.where == "prepare" else self

    def respond(self, load):
        return 1 / 0 if self.where == "respond" else np.zeros(3)


def test_what_one_model_lacks_is_no_others_fault(asked):
    broken = [Broken("prepare"), Broken("respond"), Broken("shape"), pp.FEM(level=4)]
    found = pp.compare(asked, [*broken, pp.LinearFEM()], repeats=1)
    rows = found.table[found.table["model"] != "zero"].set_index("model")
    assert (rows["failures"] > 0).tolist() == [True] * 4 + [False]
    assert rows["rmse_of_peak"].notna().tolist() == [False] * 4 + [True]
    failures = rows["failure"].tolist()
    assert all(each.startswith("Broken: ") for each in failures[:3]) and "level is 4" in failures[3]
    line = Broken.respond.__code__.co_firstlineno + 1
    assert f"{__file__}, line {line}, ZeroDivisionError" in failures[1]
    with pytest.raises(InputError, match="no model has answered"):
        pp.plot_precision(pp.compare(asked, broken[:1], repeats=1), "none.png")


NAMESAKE = type("Truth", (Broken,), {})("nowhere")  # a model of that name would be taken for the truth's own error


@pytest.mark.parametrize("models", [pp.FEM(), [pp.FEM], [pp.Gravity()], [pp.FEM(), pp.FEM()], [], [pp.FEM(), NAMESAKE]])
def test_what_is_no_list_of_different_models_is_refused(asked, models):
    with pytest.raises(InputError, match=r"model|twice|call your class"):
        pp.compare(asked, models)


BOX = pp.Box(sizes_m=(0.1, 0.1, 0.1), divisions=(2, 2, 2), young_pa=3e3, poisson=0.3)
NOWHERE = pp.Press(node=1, force_n=1.0)
NOTHING_FOUND = (pd.DataFrame(), pd.DataFrame())


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: pp.compare(BOX, [pp.FEM()]), "make_case"),
        (lambda: pp.advise(BOX, budget_ms=1), "compare"),
        (lambda: pp.advise(Comparison(*NOTHING_FOUND), budget_ms=0.0), "budget_ms"),
        (lambda: pp.advise(Comparison(*NOTHING_FOUND), max_error=1.0), "max_error"),
        (lambda: pp.plot_precision(Comparison(*NOTHING_FOUND), "x.txt"), r"\.png"),
        (lambda: pp.make_case(pp.Box, radius_m=0.02), "no body"),
        (lambda: pp.make_case(BOX, radius_m=0.02, peak_of_size=np.nan), "peak_of_size"),
        (lambda: pp.FEM().answer(BOX, NOWHERE), r"make\(\)"),
        (lambda: pp.FEM().answer(BOX.make(), 3), "no press"),
        (lambda: pp.make_case(BOX, radius_m=0.02, contacts=24.5), "contacts is 24.5"),
        (lambda: pp.FEM().answer(BOX.make(), pp.Press(node=0, force_n=1.0, radius_m=20.0)), "radius_m .* is 20 m"),
        (lambda: pp.load(None), "path is None"),
        (lambda: BOX.make().to_skfem(-1), "levels 0 to"),
        (lambda: pp.simulate(BOX, [], step_s=0.1, duration_s=0.1, others=[BOX]), r"others\[0\] is a Box"),
        (lambda: BOX.make().plot("nofolder/x.png"), "folder nofolder"),
    ],
)
def test_a_wrong_argument_of_a_script_is_refused_in_a_sentence(call, said):
    with pytest.raises(InputError, match=said):
        call()
