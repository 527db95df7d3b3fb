"""The database that is made from simulations is whole, and its two protocols are what they say."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.database import read, write
from palpate.benchmark.static_responses import Responses, assemble, digest, subsample
from palpate.errors import InputError


@pytest.fixture
def simulated(body):
    random = np.random.default_rng(3)
    free = np.setdiff1d(body.coarse.surface, body.anchors[0])
    numbers = {"sample": range(4), "contact": free[:4]}
    loads = pd.DataFrame({**numbers, "force_x_n": 1.0, "force_y_n": 0.0, "force_z_n": [1.0, 2, 3, 4]})

    def responses(mesh, seconds):
        ones = np.ones(4)
        moved = random.normal(size=(4, *mesh.nodes.shape))
        return Responses(np.arange(4), moved, ones, ones, 1e-11 * ones, seconds * ones, ones, 0 * ones)

    return loads, responses(body.fine, 3.0), responses(body.coarse, 0.5)


@pytest.fixture
def made(body, simulated):
    loads, fine, coarse = simulated
    paper = fine.sample, subsample(body, fine.displacement)
    return assemble(body, loads, fine, paper, coarse, "abc"), fine.displacement, coarse.displacement


def test_it_can_be_stored_and_read(made, tmp_path):
    write(made[0], tmp_path / "database.h5")
    assert np.array_equal(read(tmp_path / "database.h5").fine, made[0].fine)


def test_a_sample_costs_what_both_meshes_took(made):
    assert made[0].seconds.tolist() == [3.5] * 4


def test_responses_to_other_loads_are_refused(body, simulated):
    loads, fine, coarse = simulated
    paper = fine.sample, subsample(body, fine.displacement)
    for name, parts in {
        "fine": (replace(fine, sample=fine.sample + 1), paper, coarse),
        "subsampled": (fine, (paper[0][::-1], paper[1]), coarse),
        "coarse": (fine, paper, replace(coarse, sample=coarse.sample[:2])),
    }.items():
        with pytest.raises(InputError, match=f"the {name} responses are not those to the loads"):
            assemble(body, loads, *parts, "abc")


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
