"""The column in clusters, as paper 3's figure 3.11 has it."""

import numpy as np
import pytest

from palpate.studies.shape_matching import clusters
from palpate.studies.shape_matching.clusters import column

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def table():
    return clusters.clustered_column(0.15, 0.5, 0.8)


def test_more_clusters_bend_farther_and_finer(table):
    assert table.groupby("clusters").size().to_dict() == {1: 60, 2: 60, 5: 60}
    tips, curved = [], []
    for _, group in table.groupby("clusters"):
        axis = group.groupby("rest_z_m")[["x_m", "z_m"]].mean().to_numpy()
        directions = np.diff(axis, axis=0)
        angles = np.arctan2(directions[:, 0], directions[:, 1])
        tips.append(axis[-1, 0] - axis[0, 0])
        curved.append(np.ptp(angles[1:]))  # the lowest layer is held
    assert np.all(np.diff(tips) > 0)
    assert np.all(np.diff(curved) > 0)


def test_what_is_held_stays_the_rest_is_symmetric_and_comes_out_again(table):
    foot = table[table["rest_z_m"] == 0]
    assert np.array_equal(foot[["x_m", "y_m", "z_m"]], foot[["rest_x_m", "rest_y_m", "rest_z_m"]])
    front, back = (group for _, group in table.groupby("rest_y_m"))
    assert np.abs(front["x_m"].to_numpy() - back["x_m"].to_numpy()).max() < 1e-9
    assert table.equals(clusters.clustered_column(0.15, 0.5, 0.8))


@pytest.fixture(scope="module")
def goals_table():
    return clusters.cluster_goals(0.15, 0.5, 0.8).set_index(["kind", "goals"])


def test_added_pulls_are_unstable_from_four_over_the_eigenvalue_on(goals_table):
    letter = goals_table.loc[("each_tetrahedron", "sum")]
    assert letter["alpha_limit_measured"] == pytest.approx(letter["alpha_limit"], rel=0.01)
    assert 4.0 / letter["clusters_most"] <= letter["alpha_limit"] < 1.0
    averaged = goals_table.xs("mean", level="goals")
    assert np.isinf(averaged[["alpha_limit", "alpha_limit_measured"]]).all(axis=None)


def test_there_is_a_cluster_for_each_tetrahedron_and_momentum_is_kept(goals_table):
    assert goals_table.loc["each_tetrahedron"]["clusters"].unique().tolist() == [len(column().tetrahedra)]
    assert (goals_table.loc["tetrahedra"]["clusters"] < len(column().tetrahedra) / 3).all()
    assert (goals_table["drift"] < 1e-13).all()
    assert goals_table["peak_m"].between(0.01, 0.5).all()
    added = goals_table.xs("sum", level="goals")
    assert added["alpha"].to_numpy() == pytest.approx((0.5 / added["clusters_mean"]).to_numpy())


@pytest.fixture(scope="module")
def modes_table():
    return clusters.deformation_modes()


def best(rest, x, quadratic):
    """The part of the displacement that the least-squares polynomial leaves, by another way than goals are found."""
    q = rest - rest.mean(axis=0)
    a, b, c = q.T
    terms = [np.ones_like(a), a, b, c] + ([a * a, b * b, c * c, a * b, b * c, c * a] if quadratic else [])
    columns = np.stack(terms, axis=1)
    fitted = columns @ np.linalg.lstsq(columns, x, rcond=None)[0]
    return np.linalg.norm(fitted - x) / np.linalg.norm(x - rest)


def test_each_mode_misses_what_the_best_polynomial_misses(modes_table):
    for (deformation, mode), group in modes_table.groupby(["deformation", "mode"]):
        rest, x, goal = (group[[f"{w}{a}_m" for a in "xyz"]].to_numpy() for w in ("rest_", "", "goal_"))
        left = np.linalg.norm(goal - x) / np.linalg.norm(x - rest)
        assert left == pytest.approx(group["left"].iloc[0], rel=1e-12)
        least = best(rest, x, mode == "quadratic")
        if mode == "quadratic" or (mode, deformation) == ("linear", "linear"):
            assert left < 1e-12 and least < 1e-12
        else:
            assert left > least - 1e-12 and left > 0.2
            assert mode == "rigid" or left < 1.25 * least  # it keeps the volume too, which costs little
