"""The depth from which on a law matters more than a mesh, of curves that are known."""

import numpy as np
import pytest

from palpate.studies.law.compare_laws import DEPTH_COLUMNS, crossing, from_depths

DEPTHS = np.array([0.01, 0.03, 0.06, 0.1])


@pytest.mark.parametrize("depth", [0.01, 0.02, 0.045, 0.099])
@pytest.mark.parametrize("power", [1.0, 2.0])
def test_a_power_of_the_depth_is_met_exactly(depth, power):
    assert crossing(DEPTHS, (DEPTHS / depth) ** power) == pytest.approx(depth)


def test_what_is_always_or_never_larger():
    assert crossing(DEPTHS, np.full(4, 1.1)) == 0.0
    assert crossing(DEPTHS, np.full(4, 0.9)) == crossing(DEPTHS, np.array([2.0, 2.0, 2.0, 0.5])) == np.inf
    assert crossing(DEPTHS, np.array([2.0, 0.5, 2.0, 3.0])) == pytest.approx(np.sqrt(0.03 * 0.06))  # the last time
    assert 0.03 < crossing(DEPTHS, np.array([0.0, 0.0, 2.0, 3.0])) <= 0.06


def test_every_change_contact_and_mesh(law_table):
    found = from_depths(law_table)
    assert list(found.columns) == DEPTH_COLUMNS
    assert set(found["changed"]) == {"law", "poisson"}
    liver = found[(found["body"] == "liver") & (found["law"] == "st_venant_kirchhoff")].set_index("mesh")["from_depth"]
    # the change is 0.3 of the depth, the meshes' errors 0.05, 0.02 and 0.005
    expected = {"linear": np.inf, "quadratic": 0.02 / 0.3, "finest": 0.005 / 0.3, "own": 0.0}
    assert liver.to_dict() == pytest.approx(expected)  # 0.001 is met before the first depth


def test_presses_without_an_answer_or_a_truth_do_not_count(law_table):
    """The cylinder's deepest press under St. Venant-Kirchhoff has no answer; of the liver, the truth is taken away."""
    found = from_depths(law_table)
    assert len(found[(found["body"] == "cylinder") & (found["law"] == "st_venant_kirchhoff")]) == 4
    law_table.loc[law_table["body"] == "liver", "believed"] = False
    assert set(from_depths(law_table)["body"]) == {"cylinder"}
