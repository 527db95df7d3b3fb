"""The column in clusters, as paper 3's figure 3.11 has it."""

import numpy as np
import pytest

from palpate.report.claims import CONFIRMED
from palpate.studies.shape_matching import claims, clusters
from palpate.studies.shape_matching.clusters import column

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def table():
    return clusters.clustered_column(0.15, 0.5, 0.8)


def test_more_clusters_bend_farther_and_finer(table):
    assert claims._column(table).verdict == CONFIRMED
    assert table.groupby("clusters").size().to_dict() == {1: 60, 2: 60, 5: 60}
    curved = []
    for _, group in table.groupby("clusters"):
        directions = np.diff(group.groupby("rest_z_m")[["x_m", "z_m"]].mean().to_numpy(), axis=0)
        curved.append(np.ptp(np.arctan2(directions[1:, 0], directions[1:, 1])))  # the lowest layer is held
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


def test_the_modes_follow_what_the_paper_says():
    assert {claim.verdict for claim in claims._modes(clusters.deformation_modes())} == {CONFIRMED}
