"""Virtual body springs keep a poke local and bring the body back, which their dampers alone do not."""

import numpy as np
import pytest

from palpate.studies.shape_matching import body_springs_poke

STIFFNESSES = [2.0, 10.0, 40.0]


@pytest.fixture(scope="module")
def table():
    return body_springs_poke.measure(0.2, STIFFNESSES)


CASE = ["case", "body_springs_n_m"]


def test_a_poke_stays_local(table):
    """By the share of the nodes that move, at the end of the hold."""
    held = table[(table["phase"] == "hold") & np.isclose(table["time_s"], 1.0)]
    sums = held.groupby(CASE)[["moved", "nodes"]].sum()
    assert (sums["nodes"] == 182).all()
    share = sums["moved"] / sums["nodes"]
    local = [share["body_springs", k] for k in STIFFNESSES]
    assert local == sorted(local, reverse=True)
    assert local[0] < 0.6 * share["none", 0.0]
    assert share["dampers_only", 0.0] == pytest.approx(share["none", 0.0], abs=0.03)


def test_the_body_comes_back(table):
    """0.25 s after the release: the stiffer the better, and better than with the dampers alone."""
    late, held = table[table["time_s"] > 1.3], table[np.isclose(table["time_s"], 1.0)]
    late, held = (rows.groupby(CASE)["max_displacement_m"].max() for rows in (late, held))
    left = late / held
    back = [left["body_springs", k] for k in STIFFNESSES]
    assert back == sorted(back, reverse=True)
    assert back[0] < 0.01 < left["dampers_only", 0.0] < left["none", 0.0]


def test_the_table_is_complete_and_repeats(table):
    assert not table.isna().any().any()
    assert list(dict.fromkeys(table["phase"])) == ["press", "hold", "release", "after"]
    particles = body_springs_poke.tube()
    assert (len(particles.nodes), len(particles.triangles)) == (182, 360)
    again = body_springs_poke.poke(particles, 0.2, "none", 0.0, {})
    assert again.equals(table[table["case"] == "none"].reset_index(drop=True))
