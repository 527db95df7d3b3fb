"""What goes wrong in a run is one sentence, last on the terminal, and the next run goes on."""

import os
import re
import subprocess
from pathlib import Path

import h5py
import pytest

from snakemake_logger_plugin_palpate import last_words
from snakemake_logger_plugin_palpate.last_words import explain, nearest_target, quote

ROOT = Path(__file__).parents[2]
BODY, MOTION = "results/data/bar/body.h5", "results/data/scenes/sag/motion.h5"


@pytest.fixture
def sagging(smoke, write_config) -> Path:
    """Write settings of one body and one scene."""
    scenes = {"sag": smoke["scenes"]["sag"]}
    return write_config({"seed": 1, "bodies": {"bar": smoke["bodies"]["bar"]}, "scenes": scenes})


@pytest.fixture
def last(run, tmp_path, sagging):
    """Run towards targets, and return the last line of a run that fails."""

    def line(*arguments: str) -> str:
        done = run(tmp_path, sagging, *arguments)
        assert done.returncode == 1, done.stdout
        assert "Traceback" not in done.stdout
        return done.stdout.splitlines()[-1]

    return line


@pytest.mark.slow
def test_a_run_names_its_jobs_and_counts_them(run, tmp_path, sagging):
    _, cost, *jobs = run(tmp_path, sagging, "--", BODY).stdout.splitlines()
    assert cost.startswith("1 job to do: about a minute on 2 cores of this machine, up to 0.3 GB")
    assert jobs == ["1 of 1: make body (bar)"]
    assert run(tmp_path, sagging, "--", BODY).stdout.splitlines()[1:] == ["everything is up to date"]
    again = run(tmp_path, sagging, "--dry-run", "--", BODY)
    assert "nothing to do: everything that was asked for is up to date" in again.stdout.splitlines()


@pytest.mark.slow
def test_a_dry_run_says_what_the_run_would_cost(run, smoke, write_config, tmp_path):
    done = run(tmp_path, write_config(smoke), "--dry-run")
    assert done.returncode == 0, done.stdout
    [line] = [line for line in done.stdout.splitlines() if " to do: " in line]
    time = r"about (a minute|\d+ minutes)"
    assert re.fullmatch(rf"\d+ jobs to do: {time} on 2 cores of this machine, up to 0\.\d GB of memory", line)
    steps = int(re.search(r"^total +(\d+)$", done.stdout, re.M)[1])
    assert int(line.split()[0]) == steps - 1  # the last one only asks for the others


@pytest.mark.slow
@pytest.mark.parametrize(
    ("more", "said"), [("\tseed: 2\n", ", column 1 has a tab; indent"), ("seed: 2\n", " has the key seed again, which")]
)
def test_a_fault_of_yaml_has_its_line_also_where_snakemake_sees_none(last, sagging, more, said):
    sagging.write_text(sagging.read_text() + more)
    assert f"config.yaml: line {len(sagging.read_text().splitlines())}{said}" in last("-n")


@pytest.mark.slow
def test_missing_settings_are_named(run, tmp_path):
    done = run(tmp_path, tmp_path / "none.yaml", "-n")
    assert done.stdout.splitlines()[-1].startswith(f"error: {tmp_path}/none.yaml is missing; check its path")


@pytest.mark.slow
def test_a_target_that_nothing_makes_gets_the_nearest_name(last):
    wrong, near = (f"results/data/{name}/body.h5" for name in ("baar", "bar"))
    assert last("-n", "--", wrong) == f"error: nothing makes {wrong}; did you mean {near}?"


@pytest.mark.slow
@pytest.mark.skipif(not (ROOT / ".venv/.whole").is_file(), reason="the environment is not the one that make builds")
def test_a_failed_make_says_the_fault_and_exits_with_makes_own_status():
    """The environment counts as up to date, whatever the dates of its files are."""
    words = ["make", "-o", ".venv/.whole", "figures/sigma_swepp"]
    # a make of its own, also where the tests are run by make
    alone = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS"))}
    done = subprocess.run(words, cwd=ROOT, env=alone, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    said = "error: nothing makes figures/sigma_swepp; did you mean figures/sigma_sweep?"
    assert done.stderr.splitlines()[-2] == said and done.stderr.splitlines()[-1].startswith("make: ***")


def test_nearest_names(monkeypatch):
    for name in ("_asked", "_studies", "_files"):
        monkeypatch.setattr(last_words, name, [])
    last_words.offer(["scenes"], ["scenes", "ct"], ["results/figures/effects.png", "results/tables/effects.csv"])
    assert nearest_target("effects") == "nothing makes effects; did you mean figures/effects or tables/effects?"
    assert nearest_target("scnes") == "nothing makes scnes; did you mean scenes?"
    assert nearest_target("ct") == "ct has no block in the settings; add ct: to them."
    assert nearest_target("nonsense").startswith("nothing makes nonsense; ask for one of scenes, or for a file")


@pytest.mark.slow
def test_a_damaged_result_is_named_and_made_again(last, run, tmp_path, sagging):
    assert run(tmp_path, sagging, "--", BODY).returncode == 0
    (tmp_path / BODY).write_bytes((tmp_path / BODY).read_bytes()[:3000])
    said = last("--", MOTION)
    assert said.startswith(f"error: {BODY} is damaged (") and said.endswith("delete it and type make.")
    (tmp_path / BODY).unlink()
    assert run(tmp_path, sagging, "--", MOTION).returncode == 0
    with h5py.File(tmp_path / MOTION) as file:
        assert len(file["positions"]) == 5


@pytest.mark.slow
def test_a_folder_that_cannot_be_written_to_is_named(last, tmp_path):
    (tmp_path / "results").mkdir()
    if os.getuid():
        (tmp_path / "results").chmod(0o555)
    else:
        mount = ["mount", "--bind", tmp_path / "results", tmp_path / "results"]
        if subprocess.run(mount, capture_output=True, check=False).returncode:
            pytest.skip("this user can neither mount nor be kept from writing")
        subprocess.run(["mount", "-o", "remount,bind,ro", tmp_path / "results"], check=True)
    try:
        said = last("--", BODY)
    finally:
        if not os.getuid():
            subprocess.run(["umount", tmp_path / "results"], check=True)
    assert said.startswith("error: results/") and "cannot be written to; change who may write there" in said


def test_what_snakemake_says_is_explained_or_quoted():
    end = ("WorkflowError", "At least one job did not complete successfully.")
    missing = ("MissingInputException", "Missing input files for rule a:\n    affected files:\n        liver.msh")
    assert explain([missing, end]).startswith("liver.msh cannot be found, and nothing makes it; put it there")
    odd = ("OddError", "Traceback (most recent call last):\n  File x\nOddError: it rains")
    assert explain([odd, end]) == ""
    assert quote([odd, end]) == "snakemake stopped (OddError: it rains); its log says where."
