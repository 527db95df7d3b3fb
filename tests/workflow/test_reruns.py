"""Only what depends on a change is computed again.

``finished`` is a copy of the workflow whose rules, settings and modules are the real ones, and has run.
"""

from copy import deepcopy

import pytest

FEM = {"compute_compliance", "choose_loads", "simulate_fine", "simulate_coarse"}
UP_TO_DATABASE = FEM | {"make_body", "assemble_database"}
AFTER_SWEEP = {"merge_table", "check_claims", "draw_sweep", "write_report"}


@pytest.fixture
def after(finished, plan, whole, write_config):
    """The jobs that are planned once ``change`` has been made to the settings or ``modules`` were edited."""

    def jobs(change=lambda settings: None, modules=()) -> dict[str, int]:
        settings = deepcopy(whole)
        change(settings)
        before = {path: path.read_text() for path in modules}
        for path, text in before.items():
            path.write_text(text + "# edited\n")
        found = plan(finished, write_config(settings), root=finished)
        for path, text in before.items():
            path.write_text(text)
        return found

    return jobs


def test_nothing_is_left_to_do(after):
    assert after() == {}


def test_a_small_poissons_ratio_is_another_reference(after):
    def change(settings):
        settings["calibration"]["floor"]["poissons"].append(1e-5)

    planned = after(change)
    assert planned["simulate_spring_reference"] == planned["tabulate_spring_floor"] == 1


def test_another_sigma_grid_reruns_the_sweep_and_no_fem(after):
    jobs = after(lambda settings: settings["enrichment"]["sigma_relative"].update(count=4))
    assert {"sweep_sigma", "evaluate_methods"} | AFTER_SWEEP <= set(jobs)
    assert not UP_TO_DATABASE & set(jobs)


def test_an_edit_of_enrichment_reruns_it_and_no_fem(after, finished):
    jobs = after(modules=[finished / "src/palpate/enrichment/blend_weights.py"])
    assert {"sweep_sigma", "evaluate_methods"} | AFTER_SWEEP <= set(jobs)
    assert not UP_TO_DATABASE & set(jobs)


def test_no_module_of_enrichment_reruns_fem(after, finished):
    jobs = after(modules=sorted((finished / "src/palpate/enrichment").glob("*.py")))
    assert {"assemble_database", "split_samples", "sweep_sigma"} <= set(jobs)
    assert not (FEM | {"make_body"}) & set(jobs)


def test_an_edit_of_the_solver_reruns_fem_and_no_meshing(after, finished):
    jobs = after(modules=[finished / "src/palpate/solvers/newton.py"])
    assert set(jobs) >= FEM
    assert "make_body" not in jobs


def test_an_edit_of_a_figure_only_draws(after, finished):
    jobs = after(modules=[finished / "src/palpate/figures/style.py"])
    draws = {"draw_meshes", "draw_responses", "draw_sweep", "draw_costs"}
    draws |= {"draw_work_precision", "draw_advice", "draw_dynamic", "draw_hard_cases", "draw_scaling"}
    draws |= {
        "draw_scenes",
        "draw_motion",
        "draw_contact_force",
        "draw_soft_bodies",
        "draw_springs",
        "draw_collision",
        "draw_ct",
        "draw_node_mass",
    }
    assert set(jobs) == draws | {"write_report", "all"}


def test_a_run_time_tolerance_leaves_the_fine_reference(after):
    jobs = after(lambda settings: settings["solver"].update(tolerance=1e-7))
    assert "simulate_coarse" in jobs
    assert "simulate_fine" not in jobs


def test_another_split_of_as_many_samples_leaves_fem(after):
    jobs = after(lambda settings: settings["bodies"]["liver"].update(train=10, test=4))
    assert "split_samples" in jobs
    assert not UP_TO_DATABASE & set(jobs)


def test_a_second_body_leaves_the_first(after):
    def change(settings):
        settings["bodies"]["second"] = settings["bodies"]["liver"]

    jobs = after(change)
    assert {rule: jobs[rule] for rule in ("make_body", "compute_compliance", "simulate_fine")} == {
        "make_body": 1, "compute_compliance": 1, "simulate_fine": 1,
    }  # fmt: skip
