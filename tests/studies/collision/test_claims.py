"""What paper 3 says of bounding volumes and of its composite tree is judged by the table's numbers."""

import pandas as pd
import pytest

from palpate.report.claims import CONFIRMED, NOT_TESTABLE, REFUTED, REFUTED_OUTSIDE
from palpate.studies.collision.claims import bounding_volumes, composite_trees, means


@pytest.fixture
def table(collision_results):
    """The sphere tree takes 4 ms, the AABB tree 1 ms, and pass 400 and 100 false pairs."""
    return collision_results["collision"].copy()


def found(table, claim, depths=""):
    """Return the one row of this claim, of the composite tree of these depths."""
    rows = composite_trees({"collision": table})
    [row] = [row for row in rows if row.claim == claim and row.premise.startswith(depths)]
    return row


TIME, PAIRS = "the composite tree's query takes a time", "the composite tree's false pairs are"


def test_the_share_of_tested_pairs_is_of_all_pairs_of_two_bodies(table):
    assert means(table)["tested"]["aabb", ""] == pytest.approx((100 + 50) / 4416**2)  # 4416 triangles each


def test_each_depth_is_judged(table):
    assert found(table, TIME, "4/2").verdict == found(table, PAIRS, "4/2").verdict == CONFIRMED
    assert found(table, TIME, "8/4").verdict.startswith(NOT_TESTABLE) and found(table, PAIRS, "8/4").verdict == REFUTED
    assert found(table, TIME, "4/2").ours == "sphere 4 ms, composite 2 ms, AABB 1 ms"
    assert found(table, PAIRS, "4/2").ours == "sphere 401, composite 101, AABB 101"


@pytest.mark.parametrize(
    ("query_ms", "verdict"),
    [
        (1.04, NOT_TESTABLE),
        (0.96, NOT_TESTABLE),
        (0.94, REFUTED),
        (1.06, CONFIRMED),
        (3.85, NOT_TESTABLE),
        (4.15, NOT_TESTABLE),
        (4.3, REFUTED),
    ],
)
def test_what_is_as_fast_as_one_of_the_two_is_not_judged(table, query_ms, verdict):
    table.loc[table["depths"] == "4/2", "query_ms"] = query_ms
    assert found(table, TIME, "4/2").verdict.split(":")[0] == verdict


@pytest.mark.parametrize(
    ("claim", "column", "wrong"),
    [
        ("AABBs are cheap to build", "build_ms", 2.6),
        ("bounding volumes discard far pairs before the narrow phase", "triangle_tests", 1e6),
    ],
)
def test_trees_of_boxes(table, claim, column, wrong):
    assert found(table, claim).verdict == CONFIRMED
    table.loc[table["structure"] == "aabb", column] = wrong
    assert found(table, claim).verdict == REFUTED


@pytest.fixture
def tables(collision_results):
    found = {name: collision_results[name].copy() for name in ("collision", "collision_precision", "collision_apart")}
    for name in ("collision", "collision_apart"):
        tight = found[name][found[name]["structure"] == "aabb"].assign(structure="obb")
        slow = [column for column in ("build_ms", "refit_ms", "query_ms") if column in tight]
        tight[slow] *= 5.0
        tight["triangle_tests"] -= 50.0
        found[name] = pd.concat([found[name], tight], ignore_index=True)
    return found


def said(tables):
    return {claim.claim.split(":")[0]: claim for claim in bounding_volumes(tables)}


def test_distant_bodies_are_discarded_sooner_only_if_queries_are(tables):
    name = "upper layers of spheres discard distant bodies fast"
    assert said(tables)[name].verdict == REFUTED
    apart = tables["collision_apart"]
    apart.loc[apart["structure"] == "composite", "query_ms"] *= 0.1
    assert said(tables)[name].verdict == CONFIRMED


def test_a_trade_needs_time_and_error_to_change_with_the_layer(tables):
    name = "the depths of the layers trade speed for accuracy"
    stopped = tables["collision_precision"]
    stopped.loc[stopped["response_m"] > 0, "response_m"] = 0.1
    assert said(tables)[name].verdict == CONFIRMED
    stopped.loc[stopped["response_m"] > 0, "response_m"] = 1e-6  # no contact would be as good an answer
    assert said(tables)[name].verdict == REFUTED
    assert "no less than that of no contact" in said(tables)[name].ours
    stopped["response_m"] = 0.1
    stopped.loc[stopped["layer"] == 2, "response_error_m"] = 1.0
    assert said(tables)[name].verdict == REFUTED


def test_a_depth_is_judged_where_bodies_overlap_by_little(tables):
    name = "tests of triangles give the depth of a contact"
    stopped = tables["collision_precision"]
    stopped["response_m"] *= 0.9
    assert said(tables)[name].verdict == CONFIRMED
    stopped.loc[stopped["exact"], "depth_error_m"] = stopped["response_m"]
    assert said(tables)[name].verdict == REFUTED
    stopped[["response_m", "depth_error_m"]] *= 5.0
    assert said(tables)[name].verdict == REFUTED_OUTSIDE


def test_the_volumes_are_judged_by_the_means_over_scenes(tables):
    name = "an AABB is cheap to update, so preferred for bodies that deform"
    assert said(tables)[name].verdict == CONFIRMED
    table = tables["collision"]
    table.loc[table["structure"] == "aabb", "refit_ms"] = 10.0
    assert said(tables)[name].verdict == REFUTED
    assert "AABB 10" in said(tables)[name].ours
