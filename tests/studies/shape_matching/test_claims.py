"""What paper 3 says of integrators, body springs, clusters and costs is judged by its experiments' tables."""

from pathlib import Path

import numpy as np
import pytest
from fixtures.results import *  # noqa: F403

from palpate.files import read_yaml
from palpate.report.claims import CONFIRMED, REFUTED
from palpate.studies.shape_matching import claims
from palpate.studies.shape_matching.claims import FRAMES_1_S, experiments

PAPER = read_yaml(Path(__file__).parents[3] / "src/palpate/studies/shape_matching/published.yaml")


def verdict(tables, claim):
    """Return what becomes of the one claim that begins so."""
    (word,) = [row.verdict for row in experiments(tables) if row.claim.startswith(claim)]
    return word


def test_published_numbers_are_those_of_the_figures():
    assert PAPER["steps_1_s"] == FRAMES_1_S


def test_all_hold_in_tables_where_they_do(shape_matching_results):
    assert {row.verdict for row in experiments(shape_matching_results)} == {CONFIRMED}


@pytest.mark.parametrize(("measured", "word"), [(2.001, CONFIRMED), (2.03, REFUTED), (np.inf, REFUTED)])
def test_the_explicit_limit(shape_matching_results, measured, word):
    stability = shape_matching_results["integrator_stability"].copy()
    stability.loc[stability["scheme"] == "symplectic_euler", "blow_up_measured"] = measured
    assert verdict(shape_matching_results | {"integrator_stability": stability}, "explicit integration") == word


@pytest.mark.parametrize(
    ("claim", "column", "value"),
    [("goal positions never", "blow_up_measured", 50.0), ("goal positions keep", "growth_measured", 0.9)],
)
def test_goal_positions_that_grow_or_fade_refute(shape_matching_results, claim, column, value):
    stability = shape_matching_results["integrator_stability"].copy()
    stability.loc[stability["scheme"] == "goal_position", column] = value
    assert verdict(shape_matching_results | {"integrator_stability": stability}, claim) == REFUTED


def changed(results, table, **columns):
    return results | {table: results[table].assign(**columns)}


def test_clusters_that_do_not_bend_farther_refute(shape_matching_results):
    clusters = shape_matching_results["clusters"]["clusters"]
    tables = changed(shape_matching_results, "clusters", x_m=0.2 / clusters)
    assert verdict(tables, "a column in more clusters") == REFUTED


def test_body_springs_that_change_nothing_refute(shape_matching_results):
    tables = changed(shape_matching_results, "body_springs", moved=5)
    assert verdict(tables, "virtual body springs keep") == REFUTED
    poke = shape_matching_results["body_springs"]
    tied = poke["case"] == "body_springs"
    deeper = poke["max_displacement_m"] * (1 + 2 * tied)
    assert (
        verdict(
            changed(shape_matching_results, "body_springs", max_displacement_m=deeper),
            "with virtual body springs a surface",
        )
        == REFUTED
    )
    left = poke["max_displacement_m"].where(poke["phase"] != "after", 0.01)
    assert (
        verdict(
            changed(shape_matching_results, "body_springs", max_displacement_m=left),
            "with virtual body springs the body comes",
        )
        == REFUTED
    )


def test_costs_that_grow_otherwise_refute(shape_matching_results):
    timing = shape_matching_results["shape_matching_timing"]
    steep = changed(shape_matching_results, "shape_matching_timing", ms_per_step=1e-6 * timing["all_particles"] ** 1.5)
    assert verdict(steep, "the cost of shape matching grows") == REFUTED
    assert verdict(steep, "the cost rises") == verdict(steep, "quadratic clusters cost") == REFUTED
    slow = changed(shape_matching_results, "shape_matching_timing", ms_per_step=20 * timing["ms_per_step"])
    assert verdict(slow, "100 objects of 100 particles") == REFUTED


def judged():
    return {(row.claim.split()[0], row.premise.split()[-1]): row for row in claims.formulas({})}


def test_a_force_that_depends_on_position_would_be_noticed(monkeypatch):
    assert judged()["forces", "1"].verdict == CONFIRMED
    recursion = claims._run
    monkeypatch.setattr(claims, "_run", lambda x, alpha, force: recursion(x, alpha + 0.1 * force.any(), force))
    assert judged()["forces", "1"].verdict == REFUTED


def test_the_volume_is_kept_without_a_share_of_rotation_only():
    assert judged()["linear", "1"].verdict == CONFIRMED
    mixed = judged()["linear", "0.8"]
    # (0.8 a + 0.2) (0.8 / sqrt(a) + 0.2)² = 1.0086 with a = 1.5^(2/3)
    assert (mixed.verdict, mixed.ours) == (REFUTED, "the goals' volume is 0.86 % larger")


def verdicts(tables, judge=claims.modes_and_clusters):
    return [claim.verdict for claim in judge(tables)]


def test_they_are_judged_by_what_the_tables_say(shape_matching_results):
    confirmed, outside = "confirmed", "outside its premise"
    assert verdicts(shape_matching_results) == [confirmed, confirmed, f"refuted {outside}", confirmed]
    goals, modes = (shape_matching_results[name].copy() for name in ("cluster_goals", "deformation_modes"))
    goals.loc[goals["goals"] == "sum", "alpha_limit_measured"] = np.inf
    goals.loc[goals["goals"] == "mean", "alpha_limit_measured"] = 0.9
    modes.loc[modes["mode"] == "quadratic", "left"] = 0.01
    changed = shape_matching_results | {"cluster_goals": goals, "deformation_modes": modes}
    assert verdicts(changed) == ["refuted", confirmed, f"{confirmed} {outside}", "refuted"]


def test_creep_is_judged_by_the_closed_solution(shape_matching_results):
    assert verdicts(shape_matching_results, claims.creep) == ["confirmed"]
    table = shape_matching_results["maxwell_creep"]
    assert verdicts({"maxwell_creep": table.assign(creep_m=1.1 * table["closed_m"])}, claims.creep) == ["refuted"]
    still = table.assign(creep_m=0.01, closed_m=0.01)
    assert verdicts({"maxwell_creep": still}, claims.creep) == ["refuted"]
