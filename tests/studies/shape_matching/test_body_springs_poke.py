"""Virtual body springs keep a poke local and bring the body back, which their dampers alone do not."""

import numpy as np
import pytest

from palpate.studies.shape_matching import body_springs_poke

STIFFNESSES = [2.0, 10.0, 40.0]


@pytest.fixture(scope="module")
def table():
    return body_springs_poke.measure(0.2, STIFFNESSES)


def shares(table):
    """Share of the nodes that move, at the end of the hold, by case and stiffness."""
    held = table[(table["phase"] == "hold") & np.isclose(table["time_s"], 1.0)]
    sums = held.groupby(["case", "body_springs_n_m"])[["moved", "nodes"]].sum()
    assert (sums["nodes"] == 182).all()
    return (sums["moved"] / sums["nodes"]).to_dict()


def remains(table, after_s):
    """The largest displacement from ``after_s`` [s] on over that at the end of the hold."""
    cases = table.groupby(["case", "body_springs_n_m"])
    return {
        key: rows.loc[rows["time_s"] > after_s, "max_displacement_m"].max()
        / rows.loc[np.isclose(rows["time_s"], 1.0), "max_displacement_m"].max()
        for key, rows in cases
    }


def test_a_poke_stays_local(table):
    share = shares(table)
    local = [share["body_springs", k] for k in STIFFNESSES]
    assert local == sorted(local, reverse=True)
    assert local[0] < 0.6 * share["none", 0.0]
    assert share["dampers_only", 0.0] == pytest.approx(share["none", 0.0], abs=0.03)


def test_the_body_comes_back(table):
    """0.25 s after the release: the stiffer the better, and better than with the dampers alone."""
    left = remains(table, 1.3)
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
