"""The part about collision follows from its tables."""

import pytest
from fixtures.material import numbers, page

PUBLISHED = {"source": "thesis"}


def test_numbers_come_from_the_tables(collision_results):
    found = numbers("collision", collision_results, PUBLISHED)
    assert (found["wrong"], found["frames"]) == (0, 1600)
    assert [(one["name"], one["fastest"], one["frame_s"]) for one in found["scenes"]] == [
        ("two livers", "AABBs", pytest.approx(1.5e-3)), ("folding sheet", "AABBs", pytest.approx(1.5e-3)),
    ]  # fmt: skip
    assert found["rivals"].iloc[0].tolist()[:2] == ["coal, OBBs, rebuilt", pytest.approx(8.0)]
    assert found["rivals"].iloc[0, -2:].tolist() == [7, 3]
    assert found["exponents"] == [(stage, *map(pytest.approx, ends)) for stage, *ends in (
        ("build", 1.0, 1.0), ("refit", 1.0, 1.0), ("query", 0.5, 0.5),
    )]  # fmt: skip
    # 2.5 ms against 1.5 ms
    assert (found["composite_name"], found["composite"]) == ("composite 4/2", pytest.approx(2.5 / 1.5))
    assert found["verdicts"] == {}
    text = " ".join(page("collision", collision_results, PUBLISHED).split())
    assert "takes 1.5 ms on one core with AABBs (coal, OBBs, rebuilt: 12 ms)." in text


def test_verdicts_on_composite_trees_are_counted(collision_results, claims):
    found = numbers("collision", collision_results | {"claims": claims}, PUBLISHED)
    # composite 4/2 is between both, 8/4 is as fast as spheres and four times as loose as AABBs
    assert found["verdicts"] == {"query time": "1 confirmed, 1 not testable", "false pairs": "1 confirmed, 1 refuted"}
