"""The example of docs/add-a-model.md works, and what is wrong with a file is said with its name."""

from pathlib import Path

import pytest

from palpate.benchmark.measure import measure
from palpate.errors import InputError
from palpate.models.load_model import load_own
from palpate.models.model_registry import model

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


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = ", "cannot be imported"),
        ("x = 1", r"has no class with prepare\(case\)"),
        (MODEL % "pass" + MODEL.replace("M", "N") % "pass", "has several classes"),
        (NOTHING + MODEL % "tried = lambda self, case: 3", "no list of such models"),
        (NOTHING + MODEL % "tried = lambda self, case: case.nothing", r"does not work \(line 6, AttributeError: "),
        ("class M:\n    def prepare(self, case):\n        return 3\n", "lacks respond"),
        (SOLVER % "return 1 / 0" + MODEL % "pass", r"\(line 4, ZeroDivisionError: "),
        (SOLVER % "return load.single()[1]" + MODEL % "pass", "shape"),
        (NOTHING + MODEL % "sees = 'force'", "sees is 'force'; give 'load' or 'deformation'"),
        (NOTHING + MODEL % "prepared = 1", "prepared is 1; give False or True"),
    ],
)
def test_a_bad_one_is_refused_by_name(tmp_path, slab_case, slab_judge, text, said):
    case = slab_case[0]
    file = tmp_path / "mine.py"
    file.write_text(text)
    with pytest.raises(InputError, match=said) as caught:
        measure(case, "mine", load_own("mine", file).tried(case, None), slab_judge, 1, 0.1)
    assert "mine.py" in str(caught.value)


def test_a_file_may_say_what_its_model_sees_and_what_precedes_a_query(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(SOLVER % "return self.frame" + MODEL % "pass")
    made = load_own("mine", file)
    assert (made.sees, made.prepared, made.reduces) == ("load", False, "")
    made.prepare(None).precede(3)
    before = "    def precede(self, load):\n        self.frame = load\n"
    told = "sees, prepared, reduces = 'deformation', True, 'p2'"
    file.write_text(SOLVER % "return self.frame" + before + MODEL % told)
    made = load_own("mine", file)
    assert (made.sees, made.prepared, made.reduces) == ("deformation", True, "p2")
    solver = made.prepare(None)
    solver.precede(3)
    assert solver.respond(4) == 3


@pytest.mark.parametrize(
    "text",
    [
        "from palpate.benchmark.model import Model\nclass M(Model):\n    n: int = 3\n    fast: bool = True\n",
        "from dataclasses import dataclass\n@dataclass\nclass M:\n    n: int = 3\n",
        "class M:\n    def __init__(self, n=3):\n        self.n = n\n",
    ],
)
def test_its_fields_are_its_setting(tmp_path, text):
    (tmp_path / "mine.py").write_text(text + "    def prepare(self, case):\n        pass\n")
    assert [each.text for each in load_own("mine", tmp_path / "mine.py").tried(None, None)] == ["n=3"]


def test_one_that_is_not_finite_has_failed(tmp_path, slab_case, slab_judge):
    case = slab_case[0]
    file = tmp_path / "mine.py"
    answer = f"import numpy\n        return numpy.full(({case.n_surface}, 3), numpy.nan)"
    file.write_text(SOLVER % answer + MODEL % "pass")
    samples, settings = measure(case, "mine", load_own("mine", file).tried(case, None), slab_judge, 1, 0.1)
    assert (samples["failure"] != "").all() and settings["failures"].item() == settings["samples"].item()
    failure = settings["failure"].item()
    assert "not finite" in failure and failure.startswith(f"{file}: ")
