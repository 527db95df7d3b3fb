"""The report needs what jobs warn of."""

import pytest
from fixtures.small_scene import BAR, SCENE

pytestmark = pytest.mark.slow

STIFF = {"sphere": {"center_m": [0.1, 0.025, 0.025], "radius_m": 0.03}, "young_pa": 3e9}  # too much for solvers


@pytest.fixture
def settings():
    bodies = {"mixed": BAR | {"poisson": 0.3, "regions": {"stiff": STIFF}}, "other": BAR | {"poisson": 0.3}}
    return {"bodies": bodies, "scenes": {name: SCENE | {"body": name} for name in bodies}}


def test_the_report_needs_warnings_of_what_it_shows_and_no_body_for_them_only(plan, write_config, tmp_path, settings):
    del settings["scenes"]["other"]
    jobs = plan(tmp_path, write_config(settings))
    assert jobs["make_body"] == jobs["simulate_scene"] == 1
