"""Snakemake's own lint, with the one exception that one locked environment makes."""

import re
import subprocess
import sys
from pathlib import Path

ALLOWED = {"Specify a conda environment or container for each rule."}


def test_nothing_but_missing_containers_is_linted():
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", "--lint"], cwd=root, capture_output=True, text=True, check=False
    )
    assert set(re.findall(r"^ +\* (.*):$", done.stderr + done.stdout, re.M)) == ALLOWED
