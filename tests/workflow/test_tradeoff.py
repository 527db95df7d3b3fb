"""The trade-off is planned a family of models at a time, and what is wrong with its settings is said."""

from pathlib import Path

import pytest

from palpate.errors import InputError
from palpate.run.settings import complete

ROOT = Path(__file__).parents[2]
TRADEOFF = {"bodies": ["liver"], "models": ["fem_p1", "fem_p2", "detail_correction"], "own_models": {}}


@pytest.fixture
def trading(smoke) -> dict:
    """Return the settings of the liver pressed, some models asked, and nothing else."""
    keys = ("seed", "bodies", "regimes", "solver", "timing")
    return {key: smoke[key] for key in keys} | {"tradeoff": dict(TRADEOFF)}


def test_alone_it_makes_its_bodies_and_no_paper(tmp_path, plan, write_config, trading):
    jobs = plan(tmp_path, write_config(trading), "tradeoff")
    assert jobs["measure_models"] == 2 and jobs["simulate_truth"] == 1 and jobs["tabulate_tradeoff"] == 1
    assert jobs["make_body"] == 1 and jobs["choose_presses"] == 1
    assert jobs["measure_bounds"] == 1 and jobs["tabulate_error_bounds"] == 1
    assert not {"evaluate_methods", "time_methods", "simulate_scene"} & set(jobs)


def test_an_own_model_is_a_family_of_its_own(tmp_path, plan, write_config, trading):
    (tmp_path / "mine.py").write_text("settings = prepare = print\n")
    trading["tradeoff"]["own_models"] = {"mine": "mine.py"}
    assert plan(tmp_path, write_config(trading), "tradeoff")["measure_models"] == 3


def test_bodies_in_depth_get_all_splits_and_other_fingers(tmp_path, plan, write_config, trading):
    trading["tradeoff"] |= {"bodies": ["liver", "abdomen"], "splits": [1, 2], "in_depth": ["liver"]}
    trading["tradeoff"] |= {"finger_radii_m": [0.01, 0.02]}  # the second is that of the regime
    jobs = plan(tmp_path, write_config(trading), "tradeoff")
    families, scenes, fingers = 2, 1, 1
    assert jobs["measure_models"] == families * (2 * scenes + fingers + scenes)
    assert jobs["choose_presses"] == jobs["simulate_truth"] == 2 * scenes + fingers
    assert jobs["measure_bounds"] == 2 * scenes + scenes + fingers


def test_any_load_is_a_job_for_each_scene_and_runs_again_when_its_models_change(tmp_path, plan, write_config, trading):
    assert "measure_any_load" not in plan(tmp_path, write_config(trading), "tradeoff")
    (tmp_path / "mine.py").write_text("settings = prepare = print\n")
    trading["tradeoff"] |= {"own_models": {"mine": "mine.py"}, "any_load": {"models": {"mine": "", "fem_p1": "rest"}}}
    jobs = plan(tmp_path, write_config(trading), "tradeoff")
    assert jobs["measure_any_load"] == jobs["merge_any_load"] == 1


def test_presses_beyond_the_design_are_a_job_for_each_scene(tmp_path, plan, write_config, trading):
    trading["tradeoff"] |= {"beyond_design": {"models": {"fem_p1": "rest"}}}
    jobs = plan(tmp_path, write_config(trading), "tradeoff")
    assert jobs["measure_beyond_design"] == jobs["merge_beyond_design"] == 1


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"models": ["fem_p2", "fem_p3"]}, "tradeoff names fem_p3, which is unknown; did you mean fem_p"),
        ({"models": ["detail_correction"]}, "tradeoff.models lacks fem_p2"),
        (
            {"settings": {"cascade": {"stages": [{"model": "linear_fm"}]}}},
            "tradeoff.settings.cascade.stages names linear_fm, which is unknown; did you mean linear_fem?",
        ),
        ({"bodies": ["livr"]}, "tradeoff names livr, which is unknown; did you mean liver?"),
        ({"bodies": ["bar"]}, "tradeoff names bar, which is not refined; give it refinements of at least 1."),
        ({"in_depth": ["bar"]}, "tradeoff.in_depth names bar, which is unknown; "),
        ({"any_load": {"bodies": ["livr"]}}, "tradeoff.any_load.bodies names livr, which is unknown"),
        ({"any_load": {"regimes": ["smal"]}}, "tradeoff.any_load.regimes names smal, which is unknown"),
        ({"any_load": {"models": {"fem_p3": ""}}}, "tradeoff.any_load.models names fem_p3, which is unknown"),
        ({"any_load": {"models": {"fem_p2": "["}}}, "tradeoff.any_load.models.fem_p2: [ is no regular expression"),
        ({"training_contacts_of": {"linear_fem": "["}}, "tradeoff.training_contacts_of.linear_fem: [ is no regular"),
        ({"training_contacts_of": {"linear": ""}}, "tradeoff.training_contacts_of names linear"),
        ({"beyond_design": {"bodies": ["livr"]}}, "tradeoff.beyond_design.bodies names livr, which is unknown"),
        ({"splits": [6]}, "tradeoff.splits[0] is 6, but must be at most 5"),
        ({"contacts": 4}, "tradeoff.contacts is 4, but must be at least 5"),
        (
            {"presses": [{"magnitude": 1, "tilt_degrees": 60}]},
            "tradeoff.presses[0].tilt_degrees is 60, but must be at most 45",
        ),
        (
            {"own_models": {"detail_correction": "mine.py"}},
            "tradeoff names detail_correction, which palpate uses itself",
        ),
        ({"own_models": {"mine": "nowhere.py"}}, "tradeoff.own_models.mine is nowhere.py, where there is no file"),
        ({"budget": 2}, "tradeoff has an unknown key budget; did you mean budget_s?"),
        ({"advice": {"budgets_ms": []}}, "tradeoff.advice.budgets_ms"),
        ({"budget_s": 0}, "tradeoff.budget_s is 0, but must be above 0"),
    ],
)
def test_what_is_wrong_is_said(trading, changes, said):
    trading["tradeoff"] |= changes
    with pytest.raises(InputError) as caught:
        complete(trading, Path("config.yaml"))
    assert str(caught.value).startswith(f"config.yaml: {said}")


def test_it_needs_bodies_that_are_sampled(trading):
    trading["bodies"] = {"bar": trading["bodies"]["bar"]}
    trading["tradeoff"]["bodies"] = None
    with pytest.raises(InputError, match="tradeoff is there and no body is refined"):
        complete(trading, Path("config.yaml"))


def test_a_regime_with_the_name_of_a_finger_is_refused(trading):
    trading["regimes"]["finger_4000_um"] = {"radius_m": 0.01}
    trading["tradeoff"]["finger_radii_m"] = [0.004]
    with pytest.raises(InputError, match=r"regimes\.finger_4000_um has the name of a regime of finger_radii_m; give"):
        complete(trading, Path("config.yaml"))


def test_it_needs_regimes_for_bodies_that_are_there(trading):
    trading["regimes"]["small"]["radius_of_body_m"] = {"livr": 0.01}
    with pytest.raises(InputError, match=r"regimes\.small\.radius_of_body_m names livr, which is unknown"):
        complete(trading, Path("config.yaml"))
    del trading["regimes"]
    with pytest.raises(InputError, match="tradeoff is there and there are no regimes"):
        complete(trading, Path("config.yaml"))
