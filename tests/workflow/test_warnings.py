"""What jobs warn of stands at the end of a run for as long as it holds, and no longer."""

import pytest
from fixtures.small_scene import BAR, SCENE

pytestmark = pytest.mark.slow

STIFF = {"sphere": {"center_m": [0.1, 0.025, 0.025], "radius_m": 0.03}, "young_pa": 3e9}  # too much for solvers


@pytest.fixture
def settings():
    bodies = {"mixed": BAR | {"poisson": 0.3, "regions": {"stiff": STIFF}}, "other": BAR | {"poisson": 0.3}}
    return {"bodies": bodies, "scenes": {name: SCENE | {"body": name} for name in bodies}}


@pytest.fixture
def warned(run, write_config, tmp_path):
    """Make the bodies of some settings; return the warnings that stand at the end, after those of the jobs."""

    def after(settings, *names):
        done = run(tmp_path, write_config(settings), *(f"results/data/{name}/body.h5" for name in names))
        assert done.returncode == 0, done.stdout
        end = done.stdout.partition("warnings about these results:")[2]
        told = [line.split(":")[1].strip() for line in end.splitlines() if line.startswith("warning: ")]
        return list(dict.fromkeys(told))  # a body may have several

    return after


def test_a_warning_stays_until_it_no_longer_holds(warned, settings):
    assert warned(settings, "mixed", "other") == ["bodies.mixed"]
    settings["bodies"]["other"]["young_pa"] = 4000.0
    assert warned(settings, "mixed", "other") == ["bodies.mixed"]  # of a job that was not run
    assert warned(settings, "other") == []  # not of what is not asked for
    del settings["bodies"]["mixed"]["regions"]
    assert warned(settings, "mixed", "other") == []


def test_the_report_needs_warnings_of_what_it_shows_and_no_body_for_them_only(plan, write_config, tmp_path, settings):
    del settings["scenes"]["other"]
    jobs = plan(tmp_path, write_config(settings))
    assert jobs["make_body"] == jobs["simulate_scene"] == 1
