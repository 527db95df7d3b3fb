"""Run the real workflow from the command line, in a folder of the test's own."""

import re
import shutil
import subprocess
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path

import pytest
import yaml
from fixtures.command_line import start_snakemake

ROOT = Path(__file__).parents[2]
COMPARISONS = ("tradeoff", "law", "dynamic", "hard_cases", "scaling")
"""The studies that need most of the others."""
MADE = """
import json
from snakemake.executors import touch

touch.Executor.SLEEPING_TIME = 0


onstart:
    with open("calls.jsonl", "w") as file:
        for job in filter(lambda job: job.output, workflow.dag.needrun_jobs()):
            for path in map(Path, job.output):
                if not path.suffix:  # a folder
                    path.mkdir(parents=True)
                    path /= "made.txt"
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(job.rule.name)
            given = job.params
            print(json.dumps([job.rule.name, given.call, given.lazily, given.code]), file=file)
"""
"""Stands after the rules when they are run with --touch: files that jobs would make, which are then taken for made."""


@pytest.fixture(scope="session")
def command() -> Callable[..., list[str]]:
    """The arguments of snakemake for the workflow in ``root``, with its results in ``folder``."""

    def arguments(folder: Path, config: Path, *more: str, root: Path = ROOT) -> list[str]:
        places = ["--snakefile", root / "Snakefile", "--directory", folder, "--configfile", config]
        profile = ["--profile", root / "profiles/default"]
        return [*map(str, [*places, *profile]), "--cores", "2", *more]

    return arguments


@pytest.fixture(scope="session")
def run(command, tmp_path_factory) -> Callable[..., subprocess.CompletedProcess]:
    """Run that command to its end, with the modules in ``root``; what it printed is in ``stdout``."""

    def finish(*arguments, root: Path = ROOT, **options) -> subprocess.CompletedProcess:
        words = command(*arguments, root=root, **options)
        printed = tmp_path_factory.mktemp("printed") / "out.txt"
        process = start_snakemake(words, root / "src", printed)
        process.join()
        return subprocess.CompletedProcess(words, process.exitcode, printed.read_text(encoding="utf-8"))

    return finish


@pytest.fixture(scope="session")
def plan(run) -> Callable[..., dict[str, int]]:
    """How many jobs of each rule a dry run counts."""

    def count(*arguments, **options) -> dict[str, int]:
        done = run(*arguments, "--dry-run", **options)
        assert done.returncode == 0, done.stdout
        table = re.search(r"^job +count\n[- ]+\n(.*?)^total", done.stdout, re.M | re.S)
        return {rule: int(n) for rule, n in re.findall(r"^(\w+) +(\d+)$", table[1] if table else "", re.M)}

    return count


@pytest.fixture(scope="session")
def copy_of_workflow() -> Callable[[Path], Path]:
    """Copy the workflow, its settings and its modules to a folder."""

    def copy(root: Path) -> Path:
        root.mkdir(exist_ok=True)
        for name in ("Snakefile", "workflow", "profiles", "src", "tests/smoke", "docs"):
            source = ROOT / name
            if source.is_file():
                shutil.copy(source, root / name)
            else:
                shutil.copytree(source, root / name, ignore=shutil.ignore_patterns("__pycache__"))
        return root

    return copy


@pytest.fixture(scope="session")
def finished(tmp_path_factory, copy_of_workflow, run, whole) -> Path:
    """Return a copy of the workflow that has run: real rules, settings and modules, and MADE instead of jobs."""
    root = copy_of_workflow(tmp_path_factory.mktemp("copy"))
    (root / "whole.yaml").write_text(yaml.safe_dump(whole, sort_keys=False))
    rules = (root / "Snakefile").read_text()
    (root / "Snakefile").write_text(rules + MADE)
    done = run(root, root / "whole.yaml", "--touch", root=root)
    assert done.returncode == 0, done.stdout
    (root / "Snakefile").write_text(rules)
    return root


@pytest.fixture(scope="session")
def whole() -> dict:
    """Return the smoke run's settings but for the model of one's own, whose place depends on the config file's."""
    settings = yaml.safe_load((ROOT / "tests/smoke/config.yaml").read_text())
    del settings["own_models"]
    for tissue in settings["measured"]["presses"].values():
        tissue["files"] = [str((ROOT / "tests/smoke" / file).resolve()) for file in tissue["files"]]
    for experiment in settings["measured"]["experiments"].values():
        for case in experiment["cases"].values():
            case["files"] = [str((ROOT / "tests/smoke" / file).resolve()) for file in case["files"]]
    return settings


@pytest.fixture
def smoke(whole) -> dict:
    """Return these settings, to be changed, without COMPARISONS."""
    return deepcopy({key: value for key, value in whole.items() if key not in COMPARISONS})


@pytest.fixture
def trading(smoke) -> dict:
    """Return the settings of the liver pressed, some models asked, and nothing else."""
    keys = ("seed", "bodies", "regimes", "solver", "timing")
    asked = {"bodies": ["liver"], "models": ["fem_p1", "fem_p2", "detail_correction"]}
    return {key: smoke[key] for key in keys} | {"tradeoff": asked}


@pytest.fixture
def write_config(tmp_path) -> Callable[[dict], Path]:
    """Write settings to a file of the test's own."""

    def write(settings: dict) -> Path:
        path = tmp_path / "config.yaml"
        path.write_text(yaml.safe_dump(settings, sort_keys=False))
        return path

    return write
