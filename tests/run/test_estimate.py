"""What a run will cost: what was recorded of config.yaml times this machine's speed, or what the same job took here."""

import re

import pytest

from palpate.bodies.body_file import save
from palpate.bodies.make_body import make_body
from palpate.run import estimate
from palpate.run.estimate import Estimate, Job, recorded, sizes

BODIES = {"liver": 40192, "fine": 321536}  # tetrahedra
PRESSES = 48


def job(rule: str, threads: int = 1, log: str = "", **wildcards: str) -> Job:
    return Job(rule, wildcards, threads, log)


@pytest.fixture(autouse=True)
def new_machine(tmp_path, monkeypatch):
    monkeypatch.setattr(estimate, "kernel_cache", lambda: tmp_path)
    monkeypatch.setattr(estimate, "free_mb", lambda: 8000.0)
    monkeypatch.setattr(estimate, "slowness", lambda: 1.0)


def test_a_model_has_seconds_of_its_own_and_a_finer_body_takes_longer():
    fem, other = (
        recorded(job("measure_models", body="liver", family=name), BODIES)[0] for name in ("fem", "interpolation")
    )
    assert fem > 10 * other
    coarse, fine = (recorded(job("simulate_truth", body=body), BODIES) for body in BODIES)
    assert 4 < fine[0] / coarse[0] <= 8 and fine[1] > 7 * coarse[1]
    assert recorded(job("draw_advice"), BODIES) == recorded(job("draw_law"), BODIES)
    assert recorded(job("mine"), BODIES) == estimate.UNKNOWN


def test_fewer_presses_take_less_but_preparation_stays():
    truth, draw = job("simulate_truth", body="liver"), job("draw_motion", body="liver")
    whole, half, none = (recorded(truth, BODIES, presses)[0] for presses in (PRESSES, PRESSES // 2, 1e-9))
    assert whole == recorded(truth, BODIES)[0]
    assert whole - half == pytest.approx(half - none)
    assert 0.2 * whole < none < 0.8 * whole
    assert recorded(draw, BODIES, 1) == recorded(draw, BODIES)


def test_a_body_has_the_elements_of_its_file_and_else_about_as_many_as_its_settings_give(tmp_path):
    liver = {"kind": "liver", "length_m": 0.2, "young_pa": 3000, "poisson": 0.3, "density_kg_m3": 1000}
    liver |= {"refinements": 1, "anchors": {"plane": {"axis": "y", "side": "max", "depth_m": 0.05}}}
    bar = {"kind": "box", "divisions": [4, 3, 2], "refinements": 0}
    expected = sizes({"liver": liver, "bar": bar, "sheet": {"divisions": [4, 3], "refinements": 0}}, tmp_path)
    assert (expected["bar"], expected["sheet"]) == (144, 24)
    body = make_body("liver", liver)
    (tmp_path / "liver").mkdir()
    save(body, tmp_path / "liver/body.h5")
    made = sizes({"liver": liver}, tmp_path)["liver"]
    assert made == len(body.fine.tetrahedra)
    assert expected["liver"] == pytest.approx(made, rel=0.05)


def test_a_run_is_described_in_plain_words():
    assert Estimate([], BODIES, 2).describe() == ["nothing to do: everything that was asked for is up to date"]
    [line] = Estimate([job("write_report")], BODIES, 1).describe()
    assert line == "1 job to do: about a minute on 1 core of this machine, up to 0.2 GB of memory"
    many = [job("measure_models", body="liver", family="fem")] * 6
    [line] = Estimate(many, BODIES, 2).describe()
    assert re.fullmatch(r"6 jobs to do: about \d minutes on 2 cores of this machine, up to \d\.\d GB of memory", line)
    [line] = Estimate(many, BODIES, None).describe()
    assert re.fullmatch(r"6 jobs to do: about \d+ minutes of one core of this machine", line)


def test_a_long_or_large_run_is_warned_of():
    lines = Estimate([job("simulate_truth", body="fine")] * 12, BODIES, 2).describe()
    assert re.match(r"warning: 100% of these \S+ (minutes|hours) are of bodies.fine", lines[1])
    assert "more than the 8.0 GB of memory that are free" in lines[2]


def test_jobs_that_hold_the_machine_wait_for_each_other():
    held, free = (Estimate([job("measure_collision", threads)] * 4, {}, 2).minutes() for threads in (2, 1))
    assert held == pytest.approx(2 * free)


def test_a_machine_half_as_fast_takes_twice_as_long(monkeypatch):
    jobs = [job("measure_collision"), job("compare_premises")]
    here = Estimate(jobs, {}, 1).minutes()
    monkeypatch.setattr(estimate, "slowness", lambda: 2.0)
    assert Estimate(jobs, {}, 1).minutes() == pytest.approx(2 * here, rel=0.02)


def test_a_job_takes_what_it_took_here_last_time_whatever_was_recorded(tmp_path):
    log = tmp_path / "a.log"
    log.write_text("took 9.0 s, 8.0 s of a core\ntook 60.0 s, 54.0 s of a core\n")
    assert Estimate([job("measure_collision", log=str(log))], {}, 1).minutes() == pytest.approx(54 / 60, rel=0.01)
    assert Estimate([job("fit_springs", log=str(log))], {}, 1).minutes() == pytest.approx(54 / 60, rel=0.01)


def write_log(path, clock: float) -> str:
    path.write_text(f"took {clock} s, {clock} s of a core\n")
    return str(path)


def test_jobs_that_were_slow_make_those_to_come_slow_in_proportion(tmp_path):
    todo = [job("simulate_truth", body="liver")] * 3
    seconds = recorded(todo[0], BODIES)[0]
    ended = [job("simulate_truth", log=write_log(tmp_path / f"{i}.log", 3 * seconds), body="liver") for i in range(20)]
    slow, usual = (Estimate(todo, BODIES, 1, ended=jobs).minutes() for jobs in (ended, []))
    assert slow == pytest.approx(3 * usual, rel=0.1)
    few = Estimate(todo, BODIES, 1, ended=ended[:1]).minutes()
    assert usual < few < slow


def test_what_is_left_falls_as_jobs_run_and_end(tmp_path):
    jobs = [job("simulate_truth", log=str(tmp_path / f"{i}.log"), body="liver") for i in range(4)]
    run = Estimate(jobs, BODIES, 1)
    seconds = 60 * run.minutes() / 4
    assert run.minutes_left(set(), {}) == run.minutes()
    half_way = run.minutes_left(set(), {jobs[0].log: seconds / 2})
    assert half_way == pytest.approx(3.5 * seconds / 60)
    write_log(tmp_path / "0.log", round(seconds, 1))
    assert run.minutes_left({jobs[0].log}, {}) == pytest.approx(3 * seconds / 60, rel=0.01)
    write_log(tmp_path / "0.log", 10 * seconds)
    assert run.minutes_left({jobs[0].log}, {}) > 2 * 3 * seconds / 60
    write_log(tmp_path / "0.log", round(seconds, 1))
    assert run.minutes_left({each.log for each in jobs}, {}) == 0.0
