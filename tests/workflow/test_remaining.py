"""What is left of a run follows the jobs that begin and end."""

import pytest

import snakemake_logger_plugin_palpate as logger


class Minutes:
    """Ten minutes a job, less those that it has run."""

    def minutes_left(self, ended: set[str], running: dict[str, float]) -> float:
        return 10.0 * (3 - len(ended)) - sum(running.values()) / 60


@pytest.fixture
def clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(logger.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(logger, "_watched", [Minutes()])
    return now


def test_minutes_left_count_what_has_ended_and_what_runs(clock):
    jobs = logger.Jobs()
    jobs.begin(1, "a.log")
    assert jobs.left() == ", 30 min left"
    clock[0] = 240.0
    jobs.begin(2, "b.log")
    assert jobs.left() == ", 26 min left"
    jobs.end(1)
    jobs.end(7)  # a job of which nobody knows
    assert jobs.left() == ", 20 min left"
    clock[0] += 360.0
    assert jobs.left() == ", 14 min left"


def test_nothing_is_said_without_an_estimate_or_of_a_minute(clock, monkeypatch):
    jobs = logger.Jobs()
    for number, log in enumerate("abc"):
        jobs.begin(number, log)
        jobs.end(number)
    assert jobs.left() == ""
    monkeypatch.setattr(logger, "_watched", [])
    assert logger.Jobs().left() == ""
