"""The command, as it is typed."""

import re
import subprocess
import sys

import pytest

from palpate.cli import main


def said(capsys, folder, *words) -> tuple[int, str]:
    """What ``palpate advise`` returns and says, on the made-up liver if no other scene is named."""
    scene = () if "--scene" in words else ("--scene", "liver_small")
    code = main(["advise", *scene, "--results", str(folder), *words])
    out, err = capsys.readouterr()
    assert bool(err) == bool(code)
    return code, out + err


def test_a_budget_gets_a_model_with_its_error_time_and_reason(capsys, trade_off_folder):
    code, text = said(capsys, trade_off_folder, "--budget-ms", "16.7")
    assert code == 0
    assert text.startswith("liver_small, within 16.7 ms: pod_rbf modes=8\n")
    error = r"error +0\.41 % of the peak displacement on average \(0\.\d+ % to 0\.\d+ % in 90 % of draws"
    assert re.search(error, text)
    assert "; at the patch 0.62 %" in text and "wrong by less than 0.69 %, by 12 contacts, 36 presses held out" in text
    assert (
        "4.5 ms an answer, 6 ms for the slowest press (medians of its calls); 95 % of single calls take at most 6 ms"
        in text
    )
    assert "64 % of the allowed time is left" in text and "30 s of preparation, 9 MB" in text
    assert re.search(r"because +least bound of nine answers in ten of 5 settings", text)


@pytest.mark.parametrize(
    ("words", "wrong"),
    [
        (["--scene", "brain_small", "--budget-ms", "1"], "--scene brain_small is not in .*; choose from liver_small"),
        (["--budget-ms", "-1"], "-1 is not a number above 0"),
        (["--budget-ms", "soon"], "soon is not a number above 0"),
        (["--max-error", "nan"], "nan is not a number above 0"),
        (["--max-error", "5"], "5 is not a share below 1; 5 % is 0.05"),
        (["--budget-ms", "1", "--max-error", "0.1"], "not allowed with"),
        (["--budget-ms", "1", "--error", "worst"], "invalid choice: 'worst'"),
        (["--speed", "20"], "liver_small: what is pressed and does not move has no speed; leave --speed out"),
        (["--speed", "20", "--budget-ms", "1"], "leave --budget-ms or --speed out"),
        (["--scene", "all", "--speed", "20"], "has no speed"),
        ([], r"advice\.csv is missing; type make"),
        (["--budget-ms", "1", "--results", "nowhere"], r"--results nowhere is no folder; type make"),
    ],
)
def test_bad_input_gets_one_sentence(capsys, trade_off_folder, words, wrong):
    code, text = said(capsys, trade_off_folder, *words)
    assert code == 1
    assert text.startswith("error: ") and text.count("\n") == 1
    assert re.search(wrong, text)


def test_it_starts_without_the_solvers():
    """Asking takes no longer than reading the tables: neither numba nor matplotlib is imported for it."""
    code = "import sys, palpate.cli; print([m for m in ('numba', 'matplotlib', 'skfem', 'pandas') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
