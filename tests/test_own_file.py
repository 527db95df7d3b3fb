"""Files of the user's own are checked without being run, and what fails in them is named by file and line."""

from pathlib import Path

import pytest

from palpate.errors import InputError
from palpate.own_file import (
    EFFECT_FUNCTIONS,
    LAW_FUNCTIONS,
    MODEL_FUNCTIONS,
    check_source,
    failure,
    import_file,
    own_fault,
)

DOCS = Path(__file__).parents[1] / "docs"


def check(tmp_path, text, functions=EFFECT_FUNCTIONS) -> None:
    file = tmp_path / "mine.py"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    check_source("my.yaml: scenes.s.own.mine", file, functions, "see docs/add-an-effect.md")


@pytest.mark.parametrize(
    "text",
    [
        "def make(p, s, e): pass",
        "from other import make",
        "from other import something as make",
        "from other import *",
        "try:\n    from fast import make\nexcept ImportError:\n    def make(p, s, e): pass",
        "raise SystemExit\nmake = 1",  # it is not run
    ],
)
def test_a_file_that_defines_the_function_passes(tmp_path, text):
    check(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = 1", r"mine\.py has no function make\(particles, settings, elastic\); see docs/add-an-effect\.md\.$"),
        ("class E:\n    def make(self): pass", r"mine\.py has no function make\("),
        ("x = 1\ndef make(p, s, e)\n    pass", r"mine\.py, line 2, is not Python \(expected ':'\); correct it\.$"),
        (b"\xff\xfe\x00", r"mine\.py is not a text file of Python \("),
    ],
)
def test_one_that_does_not_is_refused_before_it_runs(tmp_path, text, said):
    with pytest.raises(InputError, match=said) as caught:
        check(tmp_path, text)
    assert str(caught.value).startswith("my.yaml: scenes.s.own.mine: ")


def test_the_guides_examples_pass():
    check_source("models.nearest", DOCS / "example_model.py", MODEL_FUNCTIONS, "")
    check_source("own.wind", DOCS.parent / "examples/wind.py", EFFECT_FUNCTIONS, "")


@pytest.fixture
def divide(tmp_path):
    """A function of a file of the user's, whose third line fails."""
    (tmp_path / "mine.py").write_text("import numpy as np\ndef divide(a, b):\n    return a / b + np.linalg.inv(b)\n")
    return import_file(tmp_path / "mine.py", "own.mine").divide


def test_an_exception_is_said_with_the_line_it_comes_from(divide, tmp_path):
    with pytest.raises(ZeroDivisionError) as caught:
        divide(1, 0)
    assert failure(caught.value) == "line 3, ZeroDivisionError: division by zero"
    said = f"{tmp_path}/mine.py, line 3: ZeroDivisionError: division by zero (a fault in this file, not palpate's;"
    assert own_fault(caught.value).startswith(said)


def test_the_file_of_a_law_has_three_functions(tmp_path):
    check(tmp_path, (DOCS.parent / "examples/hencky.py").read_text(encoding="utf-8"), LAW_FUNCTIONS)
    with pytest.raises(InputError, match=r"has no function measure\(s, gradient, hessian\)"):
        check(tmp_path, "def shape(s, mu, gradient, hessian): pass", LAW_FUNCTIONS)
