"""Virtual body springs keep a poke local and bring the body back, which their dampers alone do not."""

import pytest

from palpate.report.claims import CONFIRMED
from palpate.studies.shape_matching import body_springs_poke, claims

STIFFNESSES = [2.0, 10.0, 40.0]


@pytest.fixture(scope="module")
def table():
    return body_springs_poke.measure(0.2, STIFFNESSES)


def test_a_poke_stays_local_and_the_body_comes_back(table):
    assert {claim.verdict for claim in claims._poke(table)} == {CONFIRMED}
    found = claims.pokes(table).set_index(["case", "body_springs_n_m"])
    assert (found["nodes"] == 182).all()
    share = found["moved"] / 182
    assert share["body_springs", 2.0] < 0.6 * share["none", 0.0]
    assert share["dampers_only", 0.0] == pytest.approx(share["none", 0.0], abs=0.03)
    late = table[table["time_s"] > 1.3].groupby(found.index.names)["max_displacement_m"].max()  # 0.25 s after release
    left = late / found["depth_m"]
    assert left["body_springs"].max() < 0.01 < left["dampers_only", 0.0] < left["none", 0.0]


def test_the_table_is_complete_and_repeats(table):
    assert not table.isna().any().any()
    assert list(dict.fromkeys(table["phase"])) == ["press", "hold", "release", "after"]
    particles = body_springs_poke.tube()
    assert (len(particles.nodes), len(particles.triangles)) == (182, 360)
    again = body_springs_poke.poke(particles, 0.2, "none", 0.0, {})
    assert again.equals(table[table["case"] == "none"].reset_index(drop=True))
