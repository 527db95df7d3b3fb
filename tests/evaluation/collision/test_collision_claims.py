"""What paper 3 says of its composite tree is confirmed or refuted by the table's numbers."""

import pandas as pd
import pytest

from palpate.evaluation.collision.collision_claims import claims

COLUMNS = ["scene", "structure", "depths", "rival", "query_ms", "triangle_tests", "pairs"]


@pytest.fixture
def table():
    """On two scenes: the sphere tree takes 4 ms, the AABB tree 1 ms, and pass 400 and 100 false pairs."""
    rows = [
        (scene, structure, depths, False, query, false + 50, 50)
        for scene in ("one", "two")
        for structure, depths, query, false in (
            ("sphere", "", 4.0, 399),
            ("aabb", "", 1.0, 99),
            ("composite", "4/2", 2.0, 119),
            ("composite", "8/4", 8.0, 299),
        )
    ]
    rows.append(("one", "obb_coal", "", True, 0.1, float("nan"), 50))
    return pd.DataFrame(rows, columns=COLUMNS)


def verdicts(table):
    found = claims(table)
    return dict(zip(found["claim"], found["verdict"], strict=True))


def test_each_depth_is_judged_on_each_scene_and_on_all(table):
    said = verdicts(table)
    assert len(said) == 2 * 2 * 3
    for place in ("all scenes", "one", "two"):
        assert said[f"query time (composite 4/2, {place})"] == "confirmed"
        assert said[f"false pairs (composite 4/2, {place})"] == "confirmed"
        assert said[f"query time (composite 8/4, {place})"] == "refuted"
        assert said[f"false pairs (composite 8/4, {place})"] == "refuted"


def test_one_scene_is_judged_by_its_own_numbers(table):
    table.loc[(table["scene"] == "two") & (table["depths"] == "4/2"), "query_ms"] = 0.5
    said = verdicts(table)
    assert said["query time (composite 4/2, two)"] == "refuted"
    assert said["query time (composite 4/2, one)"] == "confirmed"
    # the geometric mean of 2 and 0.5 ms is that of AABB trees
    assert said["query time (composite 4/2, all scenes)"] == "tied"


@pytest.mark.parametrize(
    ("query_ms", "verdict"),
    [
        (1.04, "tied"),
        (0.96, "tied"),
        (0.94, "refuted"),
        (1.06, "confirmed"),
        (3.85, "tied"),
        (4.15, "tied"),
        (4.3, "refuted"),
    ],
)
def test_what_is_as_fast_as_one_of_the_two_is_a_tie(table, query_ms, verdict):
    table.loc[(table["scene"] == "two") & (table["depths"] == "4/2"), "query_ms"] = query_ms
    assert verdicts(table)["query time (composite 4/2, two)"] == verdict


def test_the_numbers_are_reported(table):
    numbers = claims(table).set_index("claim")["measured"]
    assert numbers["query time (composite 4/2, one)"] == "sphere 4 ms, composite 2 ms, AABB 1 ms"
    assert numbers["false pairs (composite 4/2, one)"] == "sphere 400, composite 120, AABB 100"


def test_a_table_read_from_its_file_gives_the_same(table, tmp_path):
    table.to_csv(tmp_path / "collision.csv", index=False)
    assert claims(pd.read_csv(tmp_path / "collision.csv")).equals(claims(table))
