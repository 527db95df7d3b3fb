"""The column in clusters, as paper 3's figure 3.11 has it."""

import numpy as np
import pytest

from palpate.studies.shape_matching import clusters


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


def test_what_is_held_stays_and_the_rest_is_symmetric(table):
    foot = table[table["rest_z_m"] == 0]
    assert np.array_equal(foot[["x_m", "y_m", "z_m"]], foot[["rest_x_m", "rest_y_m", "rest_z_m"]])
    front, back = (group for _, group in table.groupby("rest_y_m"))
    assert np.abs(front["x_m"].to_numpy() - back["x_m"].to_numpy()).max() < 1e-9


def test_comes_out_the_same_again(table):
    assert table.equals(clusters.clustered_column(0.15, 0.5, 0.8))
