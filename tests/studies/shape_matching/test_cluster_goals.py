"""Clusters to the letter are unstable where the eigenvalue says, and averaged ones are not."""

import numpy as np
import pytest

from palpate.studies.shape_matching import clusters
from palpate.studies.shape_matching.clusters import column


@pytest.fixture(scope="module")
def table():
    return clusters.cluster_goals(0.15, 0.5, 0.8).set_index(["kind", "goals"])


def test_added_pulls_are_unstable_from_four_over_the_eigenvalue_on(table):
    letter = table.loc[("each_tetrahedron", "sum")]
    assert letter["alpha_limit_measured"] == pytest.approx(letter["alpha_limit"], rel=0.01)
    assert 4.0 / letter["clusters_most"] <= letter["alpha_limit"] < 1.0
    averaged = table.xs("mean", level="goals")
    assert np.isinf(averaged[["alpha_limit", "alpha_limit_measured"]]).all(axis=None)


def test_there_is_a_cluster_for_each_tetrahedron_and_momentum_is_kept(table):
    assert table.loc["each_tetrahedron"]["clusters"].unique().tolist() == [len(column().tetrahedra)]
    assert (table.loc["tetrahedra"]["clusters"] < len(column().tetrahedra) / 3).all()
    assert (table["drift"] < 1e-13).all()


def test_the_loaded_column_bends_in_every_variant(table):
    assert table["peak_m"].between(0.01, 0.5).all()
    assert table["alpha"].xs("sum", level="goals").tolist() == pytest.approx(
        (0.5 / table["clusters_mean"].xs("sum", level="goals")).tolist()
    )
