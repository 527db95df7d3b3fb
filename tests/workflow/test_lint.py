"""Snakemake's own lint, with the one exception that one locked environment makes."""

import re
from pathlib import Path

import pytest
from fixtures.command_line import start_snakemake

pytestmark = pytest.mark.slow

ALLOWED = {"Specify a conda environment or container for each rule."}


def test_nothing_but_missing_containers_is_linted(tmp_path):
    root, printed = Path(__file__).parents[2], tmp_path / "printed.txt"
    words = ["--lint", "--snakefile", root / "Snakefile", "--configfile", root / "config.yaml"]
    start_snakemake([*map(str, words)], root / "src", printed).join()
    assert set(re.findall(r"^ +\* (.*):$", printed.read_text(), re.M)) == ALLOWED
