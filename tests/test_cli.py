"""The command, as it is typed."""

import re
import subprocess
import sys

import pandas as pd
import pytest
from fixtures.trade_off import any_load

from palpate.benchmark.advice import advise
from palpate.benchmark.ranking import read_errors
from palpate.cli import main
from palpate.report.tables import read


def said(capsys, folder, *words) -> tuple[int, str]:
    """What ``palpate advise`` returns and says, on the made-up liver if no other scene is named."""
    scene = () if "--scene" in words else ("--scene", "liver_small")
    code = main(["advise", *scene, "--results", str(folder), *words])
    out, err = capsys.readouterr()
    assert bool(err) == bool(code)
    return code, out + err


def advised(folder, **limits) -> None:
    """Write advice.csv as a run does that is asked for these limits."""
    settings = read(folder / "tables/accuracy_vs_time.csv")
    scenes = [rows for _, rows in settings.groupby("scene")]
    found = [advise(rows, read_errors(folder / "data", rows), **limits) for rows in scenes]
    pd.concat(found).to_csv(folder / "tables/advice.csv", index=False)


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


def test_a_scene_that_moves_has_no_patch(capsys, trade_off_folder):
    advised(trade_off_folder, budgets_ms=[16.7])
    table = pd.read_csv(trade_off_folder / "tables/advice.csv")
    moved = table.iloc[:1].assign(scene="poke", times_life=2.0)
    pd.concat([table, moved]).to_csv(trade_off_folder / "tables/advice.csv", index=False)
    code, text = said(capsys, trade_off_folder, "--scene", "all", "--error", "patch")
    assert code == 0 and text.splitlines()[-1].startswith("poke: ")
    assert said(capsys, trade_off_folder, "--scene", "poke", "--error", "patch")[0] == 1


def test_a_kind_of_load_gets_a_model_of_its_own(capsys, trade_off_folder):
    any_load().to_csv(trade_off_folder / "tables/any_load.csv", index=False)
    asked = ("--scene", "liver_large", "--max-error", "0.08")
    code, text = said(capsys, trade_off_folder, *asked, "--load", "prepared")
    assert code == 0 and text.startswith("liver_large, prepared, error of at most 8 %: linear_fem\n")
    assert "4 % of the peak displacement on average, 6 % at most" in text
    code, text = said(capsys, trade_off_folder, *asked, "--load", "all")
    heads = [line for line in text.split("\n") if line.startswith("liver_large")]
    assert heads[1:] == [
        "liver_large, never prepared, error of at most 8 %: fem_p2 level=0, start=rest",
        "liver_large, two contacts, error of at most 8 %: fem_p2 level=0, start=rest",
        "liver_large, depth, error of at most 8 %: fem_p2 level=0, start=rest",
    ]
    assert "; refused by linear_fem" in text and "; of the force 19 %" in text
    code, text = said(capsys, trade_off_folder, "--scene", "liver_large", "--budget-ms", "1", "--load", "two-contacts")
    assert code == 0 and text.startswith("liver_large, two contacts, within 1 ms: linear_fem\n")
    code, text = said(capsys, trade_off_folder, "--scene", "liver_large", "--max-error", "1e-4", "--load", "depth")
    assert code == 0 and "none" in text and "of fem_p2 level=1, start=rest, is 1.4 %" in text
    assert said(capsys, trade_off_folder, "--scene", "liver_large", "--load", "depth")[0] == 1
    assert said(capsys, trade_off_folder, "--scene", "liver_smell", "--load", "depth", "--max-error", "0.1")[0] == 1


def test_without_a_scene_every_scene_gets_advice(capsys, trade_off_folder):
    assert main(["advise", "--results", str(trade_off_folder), "--budget-ms", "16.7"]) == 0
    text = capsys.readouterr().out
    assert re.findall(r"^(\w+), within 16.7 ms: ", text, flags=re.MULTILINE) == ["liver_small", "own_large"]


def test_without_a_limit_the_advice_of_the_run_is_listed(capsys, trade_off_folder):
    advised(trade_off_folder, budgets_ms=[0.001, 16.7], max_errors=[0.006])
    words = ["advise", "--results", str(trade_off_folder)]
    assert main(words) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(" (")[0] for line in lines if not line.startswith(" ")] == [
        "Advice for liver_small",
        "Advice for own_large",
    ]
    assert lines[2] == (
        "  within 16.7 ms          POD + RBF (modes=8): 0.41 % (nine in ten below 0.69 %, 12 contacts, 36 presses) in "
        "4.5 ms (slowest press 6 ms); prepared in 30 s, 9 MB"
    )
    assert lines[4].startswith("Advice for own_large")  # the truth of the liver is known well enough
    assert lines[-1] == "  The truth is known to 1.5 %: below that, models are tied."
    assert lines[1].startswith("  within 0.001 ms         none: the fastest setting, ")
    assert main([*words, "--scene", "own_large"]) == 0
    assert capsys.readouterr().out.splitlines() == lines[4:]
    assert main([*words, "--scene", "mine"]) == 1
    assert "--scene mine is not in" in capsys.readouterr().err


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
