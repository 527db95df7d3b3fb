"""``make CONFIG=mine/config.yaml`` runs a config in its folder, and ``palpate init`` writes one that can be run."""

import shlex
import subprocess
from pathlib import Path

import meshio
import pytest
from snakemake.cli import get_argument_parser

from palpate.bodies.simple_shapes import box
from palpate.init.command import init
from palpate.init.recognise import recognise

ROOT = Path(__file__).parents[2]


def make(*words: str) -> subprocess.CompletedProcess:
    """Run make without doing anything, as if the environment were there: it prints its commands."""
    there = ("--old-file=.venv/.whole", "--old-file=.venv/settings.schema.json")
    command = ["make", "--dry-run", "--no-print-directory", *there, *words]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


@pytest.fixture(scope="module")
def mine(tmp_path_factory) -> Path:
    """A config in a folder with a space in its name, as init writes it for a box."""
    tmp_path = tmp_path_factory.mktemp("own")
    block = box([0.1, 0.05, 0.05], [6, 3, 3])
    meshio.write_points_cells(tmp_path / "block.vtk", 1e3 * block.nodes, [("tetra", block.tetrahedra)])
    init(recognise([tmp_path / "block.vtk"]), tmp_path / "my block")
    return tmp_path / "my block/config.yaml"


def test_it_runs_in_the_folder_of_the_config_and_ends_with_advice_and_report(mine):
    lines = make(f"CONFIG={mine}").stdout.splitlines()
    place = f'--configfile "{mine}" --directory "{mine.parent}"'
    assert lines[0].endswith(f"profiles/default {place}")
    assert f'palpate advise --results "{mine.parent}/results"' in lines[1]
    assert lines[-1] == f'echo "The report: {mine.parent}/results/report.html"'
    for target, asked in (("tradeoff", "tradeoff"), ("figures/advice", "results/figures/advice.png")):
        line, *page = make(f"CONFIG={mine}", target).stdout.splitlines()
        assert page == ([f'echo "The page: {mine.parent}/results/report_tradeoff.html"'] if target == asked else [])
        assert line.endswith(f"{place} {asked}")
        words = shlex.split(line.partition("workflow/run.py snakemake ")[2])
        given = get_argument_parser().parse_args(words)
        assert list(given.targets) == [asked]
        assert list(map(Path, given.configfile)) == [mine] and Path(given.directory) == mine.parent


def test_what_is_deleted_is_in_the_folder_of_the_config(mine):
    (line,) = make(f"CONFIG={mine}", "clean").stdout.replace("\\\n", "").splitlines()
    assert line.startswith(f'cd "{mine.parent}" && rm -rf results/data ')
    assert make("clean").stdout.startswith('cd "." && rm -rf results/data ')
    (line,) = make(f"CONFIG={mine}", "tidy").stdout.splitlines()
    assert line.endswith(
        f'run.py tidy --workflow-profile profiles/default --configfile "{mine}" --directory "{mine.parent}"'
    )


def test_without_a_config_the_shipped_one_runs_here():
    lines = make().stdout.splitlines()
    assert lines[0].endswith("--workflow-profile profiles/default") and len(lines) == 2
    assert lines[1] == 'echo "The report: results/report.html"'


def test_the_smoke_run_has_a_folder_of_its_own():
    assert make("smoke").stdout.splitlines()[0].endswith("--directory .smoke --configfile tests/smoke/config.yaml")


def test_a_config_that_is_not_there_gets_one_sentence():
    done = make("CONFIG=nowhere.yaml")
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert (
        "CONFIG is nowhere.yaml, and there is no such file; palpate init writes one for a mesh or a CT" in done.stderr
    )


@pytest.mark.slow
def test_what_init_writes_can_be_planned(mine, plan):
    jobs = plan(mine.parent, mine)
    assert jobs["make_body"] == 1 and jobs["write_report"] == 1
    assert jobs["simulate_fine"] == 3 * 5  # three regimes of 24 contacts with 3 presses each, 15 a job
