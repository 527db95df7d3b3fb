"""Claims on modes, clusters and creep turn with their tables."""

import numpy as np
from fixtures.results import *  # noqa: F403

from palpate.studies.shape_matching import claims


def verdicts(tables, judge=claims.modes_and_clusters):
    return [claim.verdict for claim in judge(tables)]


def test_they_are_judged_by_what_the_tables_say(shape_matching_results):
    confirmed, outside = "confirmed", "refuted outside its premise"
    assert verdicts(shape_matching_results) == [confirmed, confirmed, outside, confirmed]
    goals, modes = (shape_matching_results[name].copy() for name in ("cluster_goals", "deformation_modes"))
    goals.loc[goals["goals"] == "sum", "alpha_limit_measured"] = np.inf
    goals.loc[goals["goals"] == "mean", "alpha_limit_measured"] = 0.9
    modes.loc[modes["mode"] == "quadratic", "left"] = 0.01
    changed = shape_matching_results | {"cluster_goals": goals, "deformation_modes": modes}
    assert verdicts(changed) == ["refuted", confirmed, confirmed, "refuted"]


def test_creep_is_judged_by_the_closed_solution(shape_matching_results):
    assert verdicts(shape_matching_results, claims.creep) == ["confirmed"]
    table = shape_matching_results["maxwell_creep"]
    assert verdicts({"maxwell_creep": table.assign(creep_m=1.1 * table["closed_m"])}, claims.creep) == ["refuted"]
    still = table.assign(creep_m=0.01, closed_m=0.01)
    assert verdicts({"maxwell_creep": still}, claims.creep) == ["refuted"]
