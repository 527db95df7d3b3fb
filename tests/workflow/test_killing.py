"""A run that is killed at any moment is completed by the next, and two at once are refused."""

import os
import re
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

SMOKE = Path(__file__).parents[1] / "smoke/config.yaml"
TARGET = "results/data/liver/point_small/fine_0.h5"


@pytest.fixture
def start(command, tmp_path):
    """Start the smoke run towards TARGET, and wait until it prints ``line``."""
    started = []

    def until(line: str) -> subprocess.Popen:
        words = command(tmp_path, SMOKE, "--", TARGET)
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        started.append(process)
        printed = []
        for text in process.stdout:
            printed.append(text)
            if line in text:
                return process
        raise AssertionError("".join(printed))

    yield until
    for process in started:
        process.kill()
        process.wait()
        process.stdout.close()


def test_a_killed_run_is_completed(start, run, tmp_path):
    for line, unfinished in [
        ("make body (liver)", "results/data/liver/body.h5"),
        ("unit forces at contact 1", "results/data/liver/compliance_0.0m.h5"),
        ("fine sample 1", TARGET),
    ]:
        start(line).send_signal(signal.SIGKILL)
        assert not (tmp_path / unfinished).exists()
    done = run(tmp_path, SMOKE, "--", TARGET)
    assert done.returncode == 0, done.stdout
    with h5py.File(tmp_path / TARGET) as file:
        assert len(file["displacement"]) == 14
        assert np.isfinite(file["displacement"]).all()
        assert (file["residual"][:] <= 1e-6).all()


def test_what_a_killed_run_left_running_ends_by_itself(start, tmp_path):
    run = start("unit forces at contact 1")
    run.kill()
    run.wait()
    deadline = time.monotonic() + 20
    while jobs_of(run.pid) and time.monotonic() < deadline:
        time.sleep(0.2)
    assert not jobs_of(run.pid)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_run_says_how_to_go_on_and_leaves_nothing(start, tmp_path, number):
    run = start("unit forces at contact 1")
    run.send_signal(number)
    printed = run.stdout.read().splitlines()
    assert run.wait() != 0
    assert printed[-2] == "stopping ..."
    assert re.fullmatch(rf"stopped; type snakemake .*-- {TARGET} to go on", printed[-1])
    assert not jobs_of(run.pid)
    assert not list(tmp_path.rglob(".*.part*"))


def test_a_job_killed_from_outside_is_named_last(start):
    run = start("unit forces at contact 1")
    for job in jobs_of(run.pid):
        os.kill(job, signal.SIGKILL)
    printed = run.stdout.read().splitlines()
    assert run.wait() == 1
    said = "error: compute compliance (liver, 0.0): its process was ended from outside (signal 9), most likely for lack"
    assert printed[-1].startswith(said)
    assert "results/logs/liver/compute_compliance_0.0m.log" in printed[-2] and ".snakemake/log/" in printed[-2]


def jobs_of(run: int) -> list[int]:
    """The processes that were started for a run."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            environment = (folder / "environ").read_bytes()
        except OSError:
            continue
        if f"PALPATE_RUN={run}\0".encode() in environment:
            found.append(int(folder.name))
    return [process for process in found if process != os.getpid()]


def test_a_second_run_in_the_same_folder_is_refused(start, run, tmp_path):
    start("make body (liver)")
    done = run(tmp_path, SMOKE, "--", TARGET)
    assert done.returncode == 1
    assert "error: another run is under way in this folder; wait for it or stop it first." in done.stdout
