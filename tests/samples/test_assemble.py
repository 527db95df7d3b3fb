"""The database that is made from simulations is whole, and its two protocols are what they say."""

import numpy as np
import pandas as pd
import pytest

from palpate.samples.assemble import assemble, digest
from palpate.samples.database import read, write


@pytest.fixture
def made(body):
    random = np.random.default_rng(3)
    free = np.setdiff1d(body.coarse.surface, body.anchors[0])
    loads = pd.DataFrame({"contact": free[:4], "force_x_n": 1.0, "force_y_n": 0.0, "force_z_n": [1.0, 2, 3, 4]})
    fine = random.normal(size=(4, *body.fine.nodes.shape))
    coarse = random.normal(size=(4, *body.coarse.nodes.shape))
    return assemble(body, loads, fine, coarse, np.full(4, 1e-11), "abc"), fine, coarse


def test_it_can_be_stored_and_read(made, tmp_path):
    write(made[0], tmp_path / "database.h5")
    assert np.array_equal(read(tmp_path / "database.h5").fine, made[0].fine)


def test_paper_samples_are_the_fine_ones_at_coarse_nodes_and_live_ones_the_coarse_simulation(body, made):
    db, fine, coarse = made
    assert np.array_equal(db.coarse("paper"), fine[:, : len(body.coarse.nodes)])
    assert np.array_equal(db.coarse("live"), coarse)


def test_interpolation_to_the_surface_keeps_linear_fields(body, made):
    db = made[0]
    linear = body.coarse.nodes @ np.array([[1.0, 2, 0], [0, 1, 3], [1, 0, 1]])
    expected = db.nodes_fine_surface @ np.array([[1.0, 2, 0], [0, 1, 3], [1, 0, 1]])
    assert np.abs(db.prolongation @ linear - expected).max() < 1e-14


def test_the_digest_changes_with_the_settings_and_not_with_their_order():
    assert digest({"a": 1, "b": 2.0}) == digest({"b": 2.0, "a": 1})
    assert digest({"a": 1, "b": 2.0}) != digest({"a": 1, "b": 2.1})
