"""A run that is killed at any moment is completed by the next, and two at once are refused."""

import os
import re
import shutil
import signal
import time
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import NamedTuple, TextIO

import h5py
import numpy as np
import pytest
import yaml
from fixtures.command_line import start_snakemake

pytestmark = pytest.mark.slow

SOURCES = Path(__file__).parents[2] / "src"
BODY, TARGET = "results/data/liver/body.h5", "results/data/liver/point_small/fine_0.h5"


class Started(NamedTuple):
    """A run towards TARGET, and what it prints."""

    process: BaseProcess
    printed: TextIO

    def kill(self) -> None:
        self.process.kill()
        self.process.join()

    def wait(self) -> int:
        self.process.join()
        return self.process.exitcode


@pytest.fixture(scope="module")
def config(whole, tmp_path_factory):
    """The settings of the smoke run for enrichment alone."""
    path = tmp_path_factory.mktemp("settings") / "config.yaml"
    path.write_text(yaml.safe_dump({key: whole[key] for key in ("seed", "bodies", "solver", "enrichment")}))
    return path


@pytest.fixture
def start(command, config, tmp_path):
    """Start the run, and wait until it prints ``line``."""
    started = []

    def until(line: str) -> Started:
        pipe = tmp_path / f"pipe_{len(started)}"
        os.mkfifo(pipe)
        process = start_snakemake(command(tmp_path, config, "--", TARGET), SOURCES, pipe)
        started.append(Started(process, pipe.open(encoding="utf-8")))
        printed = []
        for text in started[-1].printed:
            printed.append(text)
            if line in text:
                return started[-1]
        raise AssertionError("".join(printed))

    yield until
    for one in started:
        one.kill()
        one.printed.close()


@pytest.fixture(scope="module")
def made(run, config, tmp_path_factory):
    """A folder in which the liver is made."""
    folder = tmp_path_factory.mktemp("made")
    assert run(folder, config, "--", BODY).returncode == 0
    return folder


@pytest.fixture
def begun(start, made, tmp_path):
    """A run that has begun its second job."""
    shutil.copytree(made, tmp_path, ignore=shutil.ignore_patterns("jobs-*"), dirs_exist_ok=True)  # a socket
    return start("unit forces at contact 1")


def test_a_killed_run_is_completed(start, run, config, tmp_path):
    for line, unfinished in [
        ("make body (liver)", "results/data/liver/body.h5"),
        ("unit forces at contact 1", "results/data/liver/compliance_0.0m.h5"),
        ("fine sample 1", TARGET),
    ]:
        start(line).kill()
        assert not (tmp_path / unfinished).exists()
    done = run(tmp_path, config, "--", TARGET)
    assert done.returncode == 0, done.stdout
    with h5py.File(tmp_path / TARGET) as file:
        assert len(file["displacement"]) == 14
        assert np.isfinite(file["displacement"]).all()
        assert (file["residual"][:] <= 1e-6).all()


def test_what_a_killed_run_left_running_ends_by_itself(begun):
    begun.kill()
    deadline = time.monotonic() + 20
    while jobs_of(begun) and time.monotonic() < deadline:
        time.sleep(0.2)
    assert not jobs_of(begun)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_run_says_how_to_go_on_and_leaves_nothing(begun, tmp_path, number):
    os.kill(begun.process.pid, number)
    printed = begun.printed.read().splitlines()
    assert begun.wait() != 0
    assert printed[-2] == "stopping ..."
    assert re.fullmatch(rf"stopped; type snakemake .*-- {TARGET} to go on", printed[-1])
    assert not jobs_of(begun)
    assert not list(tmp_path.rglob(".*.part*"))


def test_a_job_killed_from_outside_is_named_last(begun):
    for job in jobs_of(begun):
        os.kill(job, signal.SIGKILL)
    printed = begun.printed.read().splitlines()
    assert begun.wait() == 1
    said = "error: compute compliance (liver, 0.0): its process was ended from outside (signal 9), most likely for lack"
    assert printed[-1].startswith(said)
    assert "results/logs/liver/compute_compliance_0.0m.log" in printed[-2] and ".snakemake/log/" in printed[-2]


def jobs_of(run: Started) -> list[int]:
    """The processes that were started for a run."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            environment = (folder / "environ").read_bytes()
        except OSError:
            continue
        if f"PALPATE_RUN={run.process.pid}\0".encode() in environment:
            found.append(int(folder.name))
    return [process for process in found if process != os.getpid()]


def test_a_second_run_in_the_same_folder_is_refused(begun, run, config, tmp_path):
    done = run(tmp_path, config, "--", TARGET)
    assert done.returncode == 1
    assert "error: another run is under way in this folder; wait for it or stop it first." in done.stdout
