"""Claims follow from the tables: each is refuted when its numbers are turned round."""

import pandas as pd
import pytest

from palpate.report.claims import CONFIRMED, OUTSIDE, REFUTED
from palpate.studies.collision.claims import bounding_volumes


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


def test_every_row_is_whole(tables):
    rows = list(bounding_volumes(tables))
    assert len(rows) == len({row.claim for row in rows}) == 9
    for row in rows:
        assert (row.paper, row.section) == (3, "4") and all(row)


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
    assert said(tables)[name].verdict == OUTSIDE


def test_the_volumes_are_judged_by_the_means_over_scenes(tables):
    name = "an AABB is cheap to update, so preferred for bodies that deform"
    assert said(tables)[name].verdict == CONFIRMED
    table = tables["collision"]
    table.loc[table["structure"] == "aabb", "refit_ms"] = 10.0
    assert said(tables)[name].verdict == REFUTED
    assert "AABB 10" in said(tables)[name].ours
