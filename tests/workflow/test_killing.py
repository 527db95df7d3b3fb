"""A run that is killed at any moment is completed by the next."""

import os
import re
import signal
import subprocess
import sys

import h5py
import numpy as np
import psutil
import pytest
import yaml

pytestmark = pytest.mark.slow

TARGET = "results/data/liver/point_small/fine_0.h5"


@pytest.fixture
def words(command, whole, tmp_path):
    """The command that makes TARGET."""
    config = tmp_path / "config.yaml"
    config.write_text(yaml.safe_dump({key: whole[key] for key in ("bodies", "solver", "enrichment")}))
    return [sys.executable, "-m", "snakemake", *command(tmp_path, config)]


def kill(words, line: str) -> int:
    """Start a run, and kill it and its jobs once it prints such a line; return its exit status when all have gone."""
    run = subprocess.Popen(words, start_new_session=True, stderr=subprocess.PIPE, text=True)
    assert any(re.search(line, printed) for printed in run.stderr)
    jobs = psutil.Process(run.pid).children(recursive=True)
    os.killpg(run.pid, signal.SIGKILL)
    run.stderr.read()  # to its end
    _, left = psutil.wait_procs(jobs, timeout=20)
    assert jobs and not left
    return run.wait()


def test_what_is_killed_is_completed_by_the_next_run(words, tmp_path):
    for line in (r"(unit forces at contact|compute_compliance, .*:) 1 of", r"simulate_fine, .*: 1 of"):
        assert kill([*words, "--", TARGET], line) != 0
        assert not (tmp_path / TARGET).exists()
        # it had no time to give the folder free
        assert subprocess.run([*words, "--unlock"], check=False).returncode == 0
    assert subprocess.run([*words, "--", TARGET], check=False).returncode == 0
    with h5py.File(tmp_path / TARGET) as file:
        assert len(file["displacement"]) == 14
        assert np.isfinite(file["displacement"]).all()
        assert (file["residual"][:] <= 1e-6).all()
