"""Single results by name, and the profile for a cluster."""

import re
import shlex
import subprocess
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PROFILE = ROOT / "profiles/slurm"
SMOKE = ROOT / "tests/smoke/config.yaml"


@pytest.mark.parametrize(
    ("asked", "made"),
    [
        (["figures/sigma_sweep"], ["default results/figures/sigma_sweep.png"]),
        (["PROFILE=slurm", "tables/sigma_sweep"], ["slurm results/tables/sigma_sweep.csv"]),
        (
            ["figures/scaling", "tables/scaling"],
            ["default results/figures/scaling.png", "default results/tables/scaling.csv"],
        ),
    ],
)
def test_single_results_can_be_asked_for(asked, made):
    done = subprocess.run(["make", "-n", *asked], cwd=ROOT, capture_output=True, text=True, check=True)
    commands = [line for line in done.stdout.splitlines() if "snakemake --workflow-profile" in line]
    assert [" ".join(shlex.split(command)[-2:]).partition("profiles/")[2] for command in commands] == made


def test_the_profile_groups_rules_that_exist():
    rules = {
        name
        for file in (ROOT / "workflow/rules").glob("*.smk")
        for name in re.findall(r"^rule (\w+):", file.read_text(), re.M)
    }
    settings = yaml.safe_load((PROFILE / "config.yaml").read_text())
    groups = dict(group.split("=") for group in settings["groups"])
    assert groups.keys() <= rules
    assert set(groups.values()) == {size.split("=")[0] for size in settings["group-components"]}


@pytest.mark.skipif(not find_spec("snakemake_executor_plugin_slurm"), reason="the executor plugin is not installed")
def test_the_profile_can_be_planned(run, tmp_path):
    done = run(tmp_path, SMOKE, "--dry-run", "--workflow-profile", str(PROFILE))
    assert done.returncode == 0, done.stdout
    assert re.search(r"^draw_\w+ +\d+$", done.stdout, re.M)
