"""What a run will cost: within a factor of 2 of what was recorded of config.yaml, and corrected by runs here."""

import re

import pytest

from palpate.run import estimate
from palpate.run.estimate import Estimate, Job, recorded

BODIES = {"liver": {"refinements": 2}, "fine": {"refinements": 3}}


def job(rule: str, threads: int = 1, log: str = "", **wildcards: str) -> Job:
    return Job(rule, wildcards, threads, log)


@pytest.fixture(autouse=True)
def new_machine(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(estimate, "kernel_cache", lambda: tmp_path)
    monkeypatch.setattr(estimate, "free_mb", lambda: 8000.0)


def test_a_model_has_seconds_of_its_own_and_a_finer_body_takes_longer():
    fem, other = (recorded(job("measure_models", body="liver", family=name), BODIES)[0] for name in ("fem", "ridge"))
    assert fem > 10 * other
    coarse, fine = (recorded(job("simulate_truth", body=body), BODIES) for body in BODIES)
    assert fine[0] == 4 * coarse[0] and fine[1] > 7 * coarse[1]
    assert recorded(job("draw_advice"), BODIES) == recorded(job("draw_law"), BODIES)
    assert recorded(job("mine"), BODIES) == estimate.UNKNOWN


def test_a_run_is_described_in_plain_words():
    assert Estimate([], BODIES, 2).describe() == ["nothing to do: everything that was asked for is up to date"]
    [line] = Estimate([job("write_report")], BODIES, 1).describe()
    assert line == "1 job to do: about a minute on 1 core of this machine, up to 0.2 GB of memory"
    many = [job("measure_models", body="liver", family="fem")] * 6
    [line] = Estimate(many, BODIES, 2).describe()
    assert re.fullmatch(r"6 jobs to do: about 4 minutes on 2 cores of this machine, up to \d\.\d GB of memory", line)
    [line] = Estimate(many, BODIES, None).describe()
    assert line == "6 jobs to do: about 7 minutes of one core of this machine"


def test_a_long_or_large_run_is_warned_of():
    lines = Estimate([job("simulate_truth", body="fine")] * 12, BODIES, 2).describe()
    assert lines[1].startswith("warning: 100% of these 36 minutes are of bodies.fine")
    assert "more than the 8.0 GB of memory that are free" in lines[2]


def test_jobs_that_hold_the_machine_wait_for_each_other():
    held, free = (Estimate([job("measure_collision", threads)] * 4, {}, 2).minutes() for threads in (2, 1))
    assert held == pytest.approx(2 * free)


def test_a_machine_half_as_fast_is_found_out_by_one_run(tmp_path):
    log = tmp_path / "a.log"
    jobs = [job("measure_collision", log=str(log)), job("compare_premises")]
    first = Estimate(jobs, {}, 1)
    log.write_text("took 60.0 s, 54.0 s of a core\n")  # recorded: 27 s
    first.remember()
    second = Estimate(jobs, {}, 1)
    assert second.minutes() == pytest.approx(2 * first.minutes(), rel=0.15)
    assert Estimate([job("measure_collision")], {}, 1).minutes() == pytest.approx(54 / 60, rel=0.1)
