"""Claims are confirmed and refuted by what the tables say."""

import numpy as np
import pandas as pd
import pytest
from fixtures.material import material

from palpate.report.parts import verdicts

PUBLISHED = {
    "enrichment": {},
    "springs": {"fitness_m": -0.05, "generations": 1000, "seconds": 3600},
    "shape_matching": {"steps_1_s": 50},
    "collision": {},
}


@pytest.fixture
def tables(results, spring_results, shape_matching_results, collision_results):
    return results | spring_results | shape_matching_results | collision_results


def found(tables, studies=tuple(PUBLISHED)):
    """Return all claims of some studies."""
    reports = [material(study, tables, PUBLISHED.get(study)) for study in studies]
    whole = reports[0]
    for report in reports[1:]:
        whole.studies |= report.studies
        whole.published |= report.published
    return verdicts.found(whole)


def verdict(tables, claim):
    """Return what becomes of the one claim that begins so."""
    claims = found(tables)
    (word,) = claims["verdict"][claims["claim"].str.startswith(claim)]
    return word


def test_only_papers_that_were_reproduced_have_claims(tables):
    assert found({"claims": tables["claims"]}, ["enrichment"])["paper"].unique().tolist() == ["paper 1"]
    assert found(tables)["paper"].nunique() == 4
    assert found({}, ["tradeoff"]).empty
    report = material("tradeoff", {})
    assert verdicts.sections(report) == [] and verdicts.numbers(report) == {}


def test_models_are_named_in_words(tables):
    claims = tables["claims"].assign(measured="ordered_nonnegative_a: 0.2; nonnegative_b: 0.1", claim="a_b=3")
    (row,) = found({"claims": claims}, ["enrichment"]).itertuples(index=False)
    assert row[3] == "contact-ordered, non-negative (a): 0.2; non-negative (b): 0.1" and row.claim == "a_b=3"


def test_one_press_is_not_enough_where_the_others_are_wrong(tables):
    # conftest: the presses that are not fitted are three times as wrong
    assert verdict(tables, "moduli fitted") == "refuted"
    fits = tables["spring_fit"].copy()
    fits.loc[~fits["used_in_fit"], "rmse_of_peak"] /= 2.5
    assert verdict(tables | {"spring_fit": fits}, "moduli fitted") == "confirmed"


def test_what_cannot_be_compared_is_said_to_be_so(tables):
    assert verdict(tables, "how long the search takes") == "cannot be compared"


@pytest.mark.parametrize(("measured", "word"), [(2.001, "confirmed"), (2.03, "refuted"), (np.inf, "refuted")])
def test_the_explicit_limit(tables, measured, word):
    stability = tables["integrator_stability"].copy()
    stability.loc[stability["scheme"] == "symplectic_euler", "blow_up_measured"] = measured
    assert verdict(tables | {"integrator_stability": stability}, "explicit integration") == word


def test_goal_positions_that_grow_refute(tables):
    assert verdict(tables, "goal positions") == "confirmed"
    stability = tables["integrator_stability"].replace({"blow_up_measured": np.inf}, 50.0)
    assert verdict(tables | {"integrator_stability": stability}, "goal positions") == "refuted"


def test_growth_clusters_and_body_springs(tables):
    for claim in ("the cost of shape matching", "a column in more", "virtual body springs"):
        assert verdict(tables, claim) == "confirmed"
    timing = tables["shape_matching_timing"].copy()
    timing["ms_per_step"] = 1e-6 * timing["all_particles"] ** 1.5
    clusters = tables["clusters"].assign(x_m=0.2 / tables["clusters"]["clusters"])
    springs = tables["body_springs"].assign(moved=5)
    changed = tables | {"shape_matching_timing": timing, "clusters": clusters, "body_springs": springs}
    for claim in ("the cost of shape matching", "a column in more", "virtual body springs"):
        assert verdict(changed, claim) == "refuted"


def test_of_scene_by_scene_claims_only_those_over_all_scenes_count(tables):
    one = tables["collision_claims"]
    scene = one.assign(claim="query time (composite 4/2, two_livers)", verdict="refuted")
    claims = found(tables | {"collision_claims": pd.concat([one, scene])}, ["collision"])
    assert claims["claim"].tolist() == one["claim"].tolist()
