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


def refutes(results, table, *claims, **columns):
    """Assert that just the claims that begin so are refuted, where a table has other columns."""
    assert {row.verdict for row in experiments(results)} == {CONFIRMED}
    rows = experiments(results | {table: results[table].assign(**columns)})
    found = [row.claim for row in rows if row.verdict == REFUTED]
    assert len(found) == len(claims) and all(map(str.startswith, found, claims))


def test_published_numbers_are_those_of_the_figures():
    assert PAPER["steps_1_s"] == FRAMES_1_S


@pytest.mark.parametrize(
    ("scheme", "column", "value", "claims"),
    [
        ("symplectic_euler", "blow_up_measured", 2.001, []),
        ("symplectic_euler", "blow_up_measured", 2.03, ["explicit integration"]),
        ("symplectic_euler", "blow_up_measured", np.inf, ["explicit integration"]),
        ("goal_position", "blow_up_measured", 50.0, ["goal positions never"]),
        ("goal_position", "growth_measured", 0.9, ["goal positions keep"]),
    ],
)
def test_integrators_are_judged(shape_matching_results, scheme, column, value, claims):
    stability = shape_matching_results["integrator_stability"]
    changed = {column: stability[column].mask(stability["scheme"] == scheme, value)}
    refutes(shape_matching_results, "integrator_stability", *claims, **changed)


def test_clusters_that_do_not_bend_farther_refute(shape_matching_results):
    bent = 0.2 / shape_matching_results["clusters"]["clusters"]
    refutes(shape_matching_results, "clusters", "a column in more clusters", x_m=bent)


def test_body_springs_that_change_nothing_refute(shape_matching_results):
    given = shape_matching_results, "body_springs"
    refutes(*given, "virtual body springs keep", moved=5)
    poke = shape_matching_results["body_springs"]
    deeper = poke["max_displacement_m"] * (1 + 2 * (poke["case"] == "body_springs"))
    refutes(*given, "with virtual body springs a surface", max_displacement_m=deeper)
    left = poke["max_displacement_m"].where(poke["phase"] != "after", 0.01)
    refutes(*given, "with virtual body springs the body comes", max_displacement_m=left)


def test_costs_that_grow_otherwise_refute(shape_matching_results):
    timing, given = shape_matching_results["shape_matching_timing"], (shape_matching_results, "shape_matching_timing")
    growing = "the cost of shape matching grows", "the cost rises", "quadratic clusters cost"
    refutes(*given, *growing, ms_per_step=1e-6 * timing["all_particles"] ** 1.5)
    refutes(*given, "100 objects of 100 particles", ms_per_step=20 * timing["ms_per_step"])


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
    table = shape_matching_results["maxwell_creep"]
    off, still = table.assign(creep_m=1.1 * table["closed_m"]), table.assign(creep_m=0.01, closed_m=0.01)
    for creeps, word in ((table, "confirmed"), (off, "refuted"), (still, "refuted")):
        assert verdicts({"maxwell_creep": creeps}, claims.creep) == [word]
