"""The command, as it is typed."""

import re
import subprocess
import sys

import pandas as pd
import pytest
from fixtures.trade_off import any_load

from palpate.benchmark.advice import advise
from palpate.benchmark.comparison import read_errors
from palpate.cli import main
from palpate.report.tables import read


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
    assert text.startswith("liver_small, within 16.7 ms: detail_correction samples=60\n")
    assert re.search(r"error +0\.4 % of the peak displacement \(0\.\d+ % to 0\.\d+ % in 90 % of draws", text)
    assert "; at the patch 2 %" in text
    assert re.search(r"time +5 ms an answer, 6 ms at the 95th percentile", text)
    assert "64 % of the allowed time is left" in text and "40 s of preparation, 3 MB" in text
    assert re.search(r"because +least validation error of 5 settings", text)


def test_the_error_at_the_patch_can_be_asked_for(capsys, trade_off_folder):
    code, text = said(capsys, trade_off_folder, "--budget-ms", "16.7", "--error", "patch")
    assert code == 0
    assert text.startswith("liver_small, within 16.7 ms: pod_rbf modes=8\n")
    assert re.search(r"error +0\.62 % of the peak displacement at the patch \(", text)
    assert "; over the whole surface 0.41 %" in text


def test_splits_that_agree_are_counted(capsys, trade_off_folder):
    path = trade_off_folder / "tables/accuracy_vs_time.csv"
    table = pd.read_csv(path)
    worse = table["model"] == "detail_correction"
    second = table.assign(split=2, failures=table["failures"] + worse)
    pd.concat([table, second]).to_csv(path, index=False)
    for errors in (trade_off_folder / "data").rglob("*_samples.csv"):
        found = pd.read_csv(errors)
        pd.concat([found, found.assign(split=2)]).to_csv(errors, index=False)
    code, text = said(capsys, trade_off_folder, "--budget-ms", "16.7")
    assert code == 0 and text.startswith("liver_small, within 16.7 ms: detail_correction samples=60\n")
    assert re.search(r"agreed +the same model in 1 of 2 splits of the contacts", text)


def test_a_kind_of_load_gets_a_model_of_its_own(capsys, trade_off_folder):
    any_load().to_csv(trade_off_folder / "tables/any_load.csv", index=False)
    asked = ("--scene", "liver_large", "--max-error", "0.08")
    code, text = said(capsys, trade_off_folder, *asked, "--load", "prepared")
    assert code == 0 and text.startswith(
        "liver_large, prepared: linear_fem\n  error     4 % of the peak displacement, 6 %"
    )
    code, text = said(capsys, trade_off_folder, *asked, "--load", "all")
    heads = [line for line in text.split("\n") if line.startswith("liver_large")]
    assert heads[1:] == [
        "liver_large, never prepared: fem_p2 level=0, start=rest",
        "liver_large, two contacts: fem_p2 level=0, start=rest",
        "liver_large, depth: fem_p2 level=0, start=rest",
    ]
    assert "; refused by linear_fem" in text and "; of the force 19 %; against the fine operator" in text
    code, text = said(capsys, trade_off_folder, "--scene", "liver_large", "--budget-ms", "1", "--load", "two-contacts")
    assert code == 0 and text.startswith("liver_large, two contacts: linear_fem\n")
    code, text = said(capsys, trade_off_folder, "--scene", "liver_large", "--max-error", "1e-4", "--load", "depth")
    assert code == 0 and "none" in text and "the setting of least error, fem_p2 level=1, start=rest, has 0.96 %" in text
    assert said(capsys, trade_off_folder, "--scene", "liver_large", "--load", "depth")[0] == 1
    assert said(capsys, trade_off_folder, "--scene", "liver_smell", "--load", "depth", "--max-error", "0.1")[0] == 1


def test_without_a_scene_every_scene_gets_advice(capsys, trade_off_folder):
    assert main(["advise", "--results", str(trade_off_folder), "--budget-ms", "16.7"]) == 0
    text = capsys.readouterr().out
    assert re.findall(r"^(\w+), within 16.7 ms: ", text, flags=re.MULTILINE) == ["liver_small", "own_large"]


def test_without_a_limit_the_advice_of_the_run_is_listed(capsys, trade_off_folder):
    settings = read(trade_off_folder / "tables/accuracy_vs_time.csv")
    limits = {"budgets_ms": [0.001, 16.7], "max_errors": [0.003]}
    scenes = [rows for _, rows in settings.groupby("scene")]
    found = [advise(rows, read_errors(trade_off_folder / "data", rows), **limits) for rows in scenes]
    pd.concat(found).to_csv(trade_off_folder / "tables/advice.csv", index=False)
    words = ["advise", "--results", str(trade_off_folder)]
    assert main(words) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(" (")[0] for line in lines if not line.startswith(" ")] == [
        "Advice for liver_small",
        "Advice for own_large",
    ]
    assert lines[2] == "  within 16.7 ms          corrected coarse FEM (samples=60): 0.4 %, 6 ms"
    assert lines[4].startswith("Advice for own_large")  # the truth of the liver is known well enough
    assert lines[-1] == "  The truth is known to 1.5 %: below that, models are tied."
    assert lines[1].startswith("  within 0.001 ms         none: the fastest setting, ")
    assert main([*words, "--scene", "own_large"]) == 0
    assert capsys.readouterr().out.splitlines() == lines[4:]
    assert main([*words, "--scene", "mine"]) == 1
    assert "--scene mine is not in" in capsys.readouterr().err


def test_none_is_an_answer(capsys, trade_off_folder):
    code, text = said(capsys, trade_off_folder, "--budget-ms", "0.001", "--scene", "own_large")
    assert code == 0
    assert text.startswith("own_large, within 0.001 ms: none\n  because   the fastest setting, linear_fem, takes")


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
        ([], r"advice\.csv is missing; type make"),
        (["--budget-ms", "1", "--results", "nowhere"], r"accuracy_vs_time\.csv is missing; type make"),
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
