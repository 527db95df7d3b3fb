"""What nobody asks for is in no plan, and a scene that cannot be is refused in one sentence."""

import pytest

pytestmark = pytest.mark.slow

SCENES = {"simulate_scene", "tabulate_scenes", "draw_motion"}
SHAPE_MATCHING = {"measure_experiments", "tabulate_shape_matching", "check_claims"}
SPRINGS = {"simulate_spring_reference", "fit_springs", "measure_spring_floor", "tabulate_springs", "check_claims"}
COLLISION = {"measure_collision", "measure_collision_precision", "draw_collision", "check_claims"}
ALONE = {"springs": SPRINGS, "law": {"make_body", "compare_laws", "tabulate_law"}}
"""The rules of studies that need no body, or whose bodies need nothing else."""
MORE = {"springs": {"fit_springs": 8}}
"""Those that run more than once."""
REPORT = {"write_report", "all"}
SHARED = ("seed", "bodies", "regimes", "solver", "timing")


@pytest.fixture
def planned(plan, whole, write_config, tmp_path):
    """Count the jobs of some studies of the smoke run's settings, some of them changed, without its body from CT."""

    def jobs(*studies, **changes) -> dict[str, int]:
        settings = {key: value for key, value in whole.items() if key in (*SHARED, *studies)}
        bodies = {name: body for name, body in whole["bodies"].items() if body["kind"] != "ct" or "ct" in studies}
        return plan(tmp_path, write_config(settings | {"bodies": bodies} | changes))

    return jobs


@pytest.mark.parametrize("study", ALONE)
def test_a_study_alone_makes_no_body_and_no_scene_but_its_own(planned, study):
    jobs = planned(study, **({} if "make_body" in ALONE[study] else {"bodies": {}}))
    assert set(jobs) == ALONE[study] | REPORT
    assert {rule: count for rule, count in jobs.items() if count > 1} == MORE.get(study, {})


def test_a_scene_alone_makes_its_own_body(planned, whole):
    jobs = planned(scenes={"sag": whole["scenes"]["sag"]})
    assert set(jobs) == SCENES | REPORT | {"make_body"} and set(jobs.values()) == {1}


def test_enrichment_alone_makes_no_scene_and_no_body_of_theirs(planned):
    jobs = planned("enrichment")
    assert not set(jobs) & ((SCENES | SHAPE_MATCHING | SPRINGS | COLLISION) - {"check_claims"})
    assert jobs["make_body"] == jobs["compute_compliance"] == 1
    assert {"simulate_fine", "sweep_sigma", "check_claims"} <= set(jobs)


def test_a_step_that_is_not_stable_is_refused_when_the_scene_runs(run, smoke, write_config, tmp_path):
    smoke["scenes"]["sag"]["integrator"] = "symplectic_euler"
    motion = "results/data/scenes/sag/motion.h5"
    done = run(tmp_path, write_config(smoke), "--", motion)
    assert done.returncode == 1 and not (tmp_path / motion).exists() and "Traceback" not in done.stdout
    (said,) = {line for line in done.stdout.splitlines() if line.startswith("error: ")}
    assert said.startswith("error: scenes.sag.step_s is 0.02 s, and symplectic_euler takes steps of up to")
