"""The part about collision follows from its tables."""

import numpy as np
import pytest
from fixtures.material import failures, numbers

PUBLISHED = {"source": "thesis"}


def test_numbers_come_from_the_tables(collision_results):
    found = numbers("collision", collision_results, PUBLISHED)
    assert found["rivals"].iloc[0].tolist()[:2] == ["coal, OBBs, rebuilt", pytest.approx(8.0)]
    assert found["rivals"].iloc[0, -2:].tolist() == [7, 3]
    powers = found["exponents"].agg(["min", "max"]).T.to_numpy()
    assert powers == pytest.approx(np.array([[1.0, 1.0], [1.0, 1.0], [0.5, 0.5]]))
    # 2.5 ms against 1.5 ms
    over = found["over_aabbs"]
    assert (over["name"], over["composite"]) == ("composite 4/2", pytest.approx(2.5 / 1.5)) and not found["verdicts"]
    wrong = failures("collision", collision_results, PUBLISHED)
    assert ("coal, OBBs, rebuilt", "two livers") in [failure[:2] for failure in wrong]


def test_verdicts_on_composite_trees_are_counted(collision_results, claims):
    found = numbers("collision", collision_results | {"claims": claims}, PUBLISHED)
    # composite 4/2 is between both, 8/4 is as fast as spheres and four times as loose as AABBs
    assert found["verdicts"] == {"query time": "1 confirmed, 1 not testable", "false pairs": "1 confirmed, 1 refuted"}
