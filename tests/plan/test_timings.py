"""Shipped timings, corrected by what jobs took on this machine."""

import os

import pytest

from palpate.files import read_yaml
from palpate.plan import timings
from palpate.plan.jobs import seconds_taken
from palpate.plan.timings import UNKNOWN_S, Timings, read_timings, remember

SHIPPED = {"solve": {"base": 0.5, "samples": 0.1}, "draw": {"base": 2.0}}


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "palpate/timings.json"


def test_seconds_are_a_base_and_a_rate_for_each_unit():
    here = Timings(SHIPPED, {})
    assert here.seconds("solve", {"samples": 20, "others": 7}) == pytest.approx(2.5)
    assert here.seconds("draw", {}) == 2.0
    assert here.seconds("measure_models mine", {}) == UNKNOWN_S


def test_a_machine_twice_as_slow_is_found_out():
    here = Timings(SHIPPED, {"solve": [[10.0, 20.0], [100.0, 200.0]]})
    assert here.seconds("solve", {"samples": 395}) == pytest.approx(80.0, rel=0.05)
    assert here.seconds("draw", {}) == pytest.approx(4.0, rel=0.05)  # never seen here, but other kinds are


def test_the_job_most_like_it_counts_most():
    here = Timings(SHIPPED, {"solve": [[1.0, 1.0], [100.0, 300.0]]})
    assert here.seconds("solve", {"samples": 995}) == pytest.approx(300.0, rel=0.2)
    assert here.seconds("solve", {"samples": 5}) == pytest.approx(1.0, rel=0.3)


def test_one_short_job_says_little_of_long_ones():
    """It may have compiled something: half of what it says is believed of a job that takes a hundred times as long."""
    here = Timings(SHIPPED, {"solve": [[1.0, 10.0]], "draw": [[100.0, 100.0]]})
    assert 1.0 < here.seconds("solve", {"samples": 995}) / 100.0 < 2.7


def test_what_is_remembered_is_read_and_the_oldest_forgotten(cache):
    remember({"draw": [[2.0, float(i)] for i in range(6)]})
    remember({"draw": [[2.0, float(i)] for i in range(6, 10)], "solve": [[1.0, 2.0]]})
    here = read_timings().here
    assert [taken for _, taken in here["draw"]] == [2, 3, 4, 5, 6, 7, 8, 9]
    assert here["solve"] == [[1.0, 2.0]]
    assert [path.name for path in cache.parent.iterdir()] == ["timings.json"]


@pytest.mark.parametrize("found", ["", "{", "[]", '{"kinds": 3}', '{"shipped": "other", "kinds": {"draw": [[1, 2]]}}'])
def test_a_file_that_does_not_fit_counts_as_none(cache, found):
    cache.parent.mkdir()
    cache.write_text(found)
    assert read_timings().here == {}
    remember({"draw": [[2.0, 3.0]]})
    assert read_timings().here == {"draw": [[2.0, 3.0]]}


def test_a_home_that_cannot_be_written_to_stops_nothing(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))  # not a folder
    remember({"draw": [[2.0, 3.0]]})
    assert read_timings().here == {}


def test_other_shipped_timings_make_these_worthless(cache, monkeypatch, tmp_path):
    remember({"draw": [[2.0, 3.0]]})
    other = tmp_path / "other.yaml"
    other.write_text("draw: {base: 7}")
    monkeypatch.setattr(timings, "SHIPPED", other)
    assert read_timings().here == {}


def test_the_time_of_a_job_is_in_its_log_once_it_has_ended(tmp_path):
    log = tmp_path / "job.log"
    assert seconds_taken(log, 0.0, False) is None
    log.write_text("solving\n")
    assert seconds_taken(log, 0.0, False) is None
    log.write_text("solving\ntook 12.5 s, 4.0 s of a core\n")
    assert seconds_taken(log, 0.0, False) == 4.0  # it waited for a core, which an idle machine has
    log.write_text("solving\ntook 12.5 s, 24.0 s of a core\n")
    assert seconds_taken(log, 0.0, False) == 12.5
    assert seconds_taken(log, 0.0, True) == 24.0
    assert seconds_taken(log, os.path.getmtime(log) + 1, True) is None


def test_shipped_timings_are_numbers_of_known_kinds():
    shipped = read_timings()
    for kind in ("start", "compile", "compute_compliance", "simulate_fine", "measure_models fem", "draw"):
        assert 0 < shipped.shipped_seconds(kind, {}) < 60
    rates = [rate for rates in read_yaml(timings.SHIPPED).values() for rate in rates.values()]
    assert len(rates) > 100 and all(isinstance(rate, int | float) and rate >= 0 for rate in rates)
