"""``make CONFIG=mine/config.yaml`` runs a config in its folder, and ``palpate init`` writes one that can be run."""

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import meshio
import pytest
from snakemake.cli import get_argument_parser

from palpate.bodies.simple_shapes import box
from palpate.init.command import init, run_of
from palpate.init.recognise import recognise

ROOT = Path(__file__).parents[2]
NAMES = ["it's $HOME `touch evil` $(touch evil)", 'a"b;touch evil&(c) \\n# ü']
"""Of folders, with what a shell or make would read."""


@pytest.fixture(scope="module", params=NAMES)
def clone(request, tmp_path_factory) -> Path:
    """The Makefile in a folder of that name, with commands that only say what they are given."""
    folder = tmp_path_factory.mktemp("clone") / request.param
    (folder / ".venv/bin").mkdir(parents=True)
    for name in ("Makefile", "workflow", "src", "environment.lock", "pyproject.toml"):
        (folder / name).symlink_to(ROOT / name)
    for name in ("snakemake", "palpate"):
        command = folder / ".venv/bin" / name
        say = "import json, sys; print(json.dumps(sys.argv[1:]))"
        command.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -c "{say}" "$@"\n')
        command.chmod(0o755)
    for name in (".whole", "settings.schema.json"):  # newer than all else, so make builds nothing
        (folder / ".venv" / name).touch()
    return folder


def make(clone: Path, *words: str, typed: str = "") -> subprocess.CompletedProcess:
    """Run make, or what is ``typed`` in a shell."""
    command = typed or shlex.join(["make", *words])
    # as if none of these tests had been started by make
    own = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS"))}
    return subprocess.run(command, shell=True, cwd=clone, capture_output=True, text=True, env=own)


@pytest.fixture(scope="module")
def mine(clone) -> Path:
    """A config in a folder of such a name, as init writes it for a box."""
    beside = clone.parent / "own"
    beside.mkdir()
    block = box([0.1, 0.05, 0.05], [6, 3, 3])
    meshio.write_points_cells(beside / "block.vtk", 1e3 * block.nodes, [("tetra", block.tetrahedra)])
    init(recognise([beside / "block.vtk"]), beside / clone.name)
    return beside / clone.name / "config.yaml"


def test_it_runs_in_the_folder_of_the_config_and_ends_with_advice_and_report(clone, mine):
    advice = mine.parent / "results/tables/advice.csv"
    advice.parent.mkdir(parents=True)
    advice.touch()
    place = [
        "--profile",
        "profiles/default",
        "--workflow-profile",
        "profiles/default",
        "--configfile",
        str(mine),
        "--directory",
        str(mine.parent),
    ]
    snakemake, advise, report = make(clone, typed=run_of(mine)).stdout.splitlines()
    assert json.loads(snakemake) == place
    assert json.loads(advise) == ["advise", "--results", f"{mine.parent}/results"]
    assert report == f"The report: {mine.parent}/results/report.html"
    line, page = make(clone, f"CONFIG={mine}", "tradeoff").stdout.splitlines()
    assert page == f"The page: {mine.parent}/results/report_tradeoff.html"
    assert json.loads(line) == [*place, "tradeoff"]
    given = get_argument_parser().parse_args(json.loads(line))
    assert list(given.targets) == ["tradeoff"] and list(map(Path, given.configfile)) == [mine]
    assert not list(clone.parent.rglob("evil"))


def test_what_is_deleted_is_in_the_folder_of_the_config(clone, mine):
    kept, gone = mine.parent / "results/mine", mine.parent / "results/data"
    for folder in (kept, gone, clone / "results/data"):
        folder.mkdir(parents=True)
    words = json.loads(make(clone, f"CONFIG={mine}", "unlock").stdout)
    assert words[-3:] == ["--directory", str(mine.parent), "--unlock"]
    assert not make(clone, f"CONFIG={mine}", "clean").returncode
    assert kept.is_dir() and mine.is_file() and not gone.exists() and (clone / "results/data").is_dir()
    assert not make(clone, "clean").returncode and not (clone / "results/data").exists()


def test_without_a_config_the_shipped_one_runs_here(clone):
    line, report = make(clone).stdout.splitlines()
    assert json.loads(line) == ["--profile", "profiles/default", "--workflow-profile", "profiles/default"]
    assert report == "The report: results/report.html"


def test_a_config_that_is_not_there_gets_one_sentence(clone):
    done = make(clone, f"CONFIG=nowhere {clone.name}.yaml")
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    said = f"CONFIG is nowhere {clone.name}.yaml, and there is no such file; palpate init writes one for a mesh or a CT"
    assert said in done.stderr


@pytest.mark.slow
def test_what_init_writes_can_be_planned(mine, plan):
    jobs = plan(mine.parent, mine)
    assert jobs["make_body"] == 1 and jobs["write_report"] == 1
    assert jobs["simulate_fine"] == 3 * 5  # three regimes of 24 contacts with 3 presses each, 15 a job
