"""The profile for a cluster."""

import re
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PROFILE = ROOT / "profiles/slurm"
SMOKE = ROOT / "tests/smoke/config.yaml"


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
