"""The trade-off is planned a family of models at a time."""

import pytest

pytestmark = pytest.mark.slow

MINE = "class Mine:\n    def prepare(self, case): pass\n"


def test_alone_it_makes_its_bodies_and_no_paper(tmp_path, plan, write_config, trading):
    jobs = plan(tmp_path, write_config(trading), "tradeoff")
    assert jobs["measure_models"] == 2 and jobs["simulate_truth"] == 1 and jobs["tabulate_tradeoff"] == 1
    assert jobs["make_body"] == 1 and jobs["choose_presses"] == 1
    assert jobs["measure_bounds"] == 1
    assert not {"sweep_sigma", "time_methods", "simulate_scene"} & set(jobs)


def test_an_own_model_is_a_family_of_its_own(tmp_path, plan, write_config, trading):
    (tmp_path / "mine.py").write_text(MINE)
    trading["own_models"] = {"mine": "mine.py"}
    assert plan(tmp_path, write_config(trading), "tradeoff")["measure_models"] == 3


def test_bodies_in_depth_get_all_splits(tmp_path, plan, write_config, trading):
    trading["tradeoff"] |= {"bodies": ["liver", "abdomen"], "splits": [1, 2], "in_depth": ["liver"]}
    jobs = plan(tmp_path, write_config(trading), "tradeoff")
    families, scenes = 2, 1
    assert jobs["measure_models"] == families * (2 * scenes + scenes)
    assert jobs["choose_presses"] == jobs["simulate_truth"] == 2 * scenes
    assert jobs["measure_bounds"] == 2 * scenes + scenes


def test_answers_from_elsewhere_are_a_table_and_a_figure_and_reach_no_advice(tmp_path, plan, write_config, trading):
    before = plan(tmp_path, write_config(trading), "tradeoff")
    (tmp_path / "engine.npz").write_bytes(b"")
    trading["tradeoff"]["answers"] = {f"liver_{next(iter(trading['regimes']))}": ["engine.npz"]}
    after = plan(tmp_path, write_config(trading), "tradeoff")
    assert after == before | {"tabulate_answers": 1}
    names = ("advice", "accuracy_vs_time", "error_bounds")
    advised = plan(tmp_path, write_config(trading), *(f"results/tables/{name}.csv" for name in names))
    assert advised["tabulate_advice"] == 1 and not {"tabulate_answers", "draw_tradeoff"} & set(advised)


def test_any_load_and_presses_beyond_the_design_are_a_job_for_each_scene(tmp_path, plan, write_config, trading):
    assert "measure_other_loads" not in plan(tmp_path, write_config(trading), "tradeoff")
    (tmp_path / "mine.py").write_text(MINE)
    trading["own_models"] = {"mine": "mine.py"}
    trading["tradeoff"] |= {"any_load": {"models": {"mine": "", "fem_p1": "rest"}}}
    trading["tradeoff"] |= {"beyond_design": {"models": {"fem_p1": "rest"}}}
    jobs = plan(tmp_path, write_config(trading), "tradeoff")
    assert jobs["measure_other_loads"] == 2 and jobs["draw_tradeoff"] == 1
