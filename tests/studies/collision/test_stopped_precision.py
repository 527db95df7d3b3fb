"""Errors of stopped trees are those of their volumes; whole trees have none but those of triangles."""

import numpy as np
import pytest

from palpate.collision.contact_points import ContactPoints
from palpate.collision.trees.tree_query import Counts
from palpate.studies.collision import stopped_precision
from palpate.studies.collision.stopped_precision import Frame, Overlap

FRAMES = 5


@pytest.fixture(scope="module")
def table():
    done = []
    found = stopped_precision.measure(FRAMES, 0, [[1, 1]], [0, 4, 30], done.append)
    assert done == ["two_livers", "instrument_press", "instrument_approach", "livers_apart"]
    return found


def test_every_scene_has_every_layer_and_the_whole_tree(table):
    assert len(table) == 4 * 3 * 4
    assert table.groupby("scene")["exact"].sum().tolist() == [3] * 4
    assert table.loc[table["exact"], "layer"].isna().all()


def test_nothing_is_missed_and_whole_trees_report_nothing_false(table):
    assert (table["missed_pairs"] == 0).all()
    whole = table[table["exact"]]
    assert (whole[["false_pairs", "false_frames", "reported_m"]] == 0).all(axis=None)


def test_bodies_that_are_always_apart_are_in_contact_for_coarse_volumes_only(table):
    apart = table[table["scene"] == "livers_apart"]
    assert (apart["frames_apart"] == FRAMES).all() and (apart["response_m"] == 0.0).all()
    assert (apart.loc[apart["layer"] == 0, "false_frames"] > 0).all()
    # the response of whole bodies' volumes is centimetres, and none where triangles are tested
    assert (apart.loc[apart["layer"] == 0, "response_error_m"] > 0.005).all()
    assert (apart.loc[apart["exact"], "response_error_m"] == 0.0).all()


def test_deeper_layers_report_contact_later(table):
    for _, rows in table[~table["exact"]].groupby(["scene", "structure"]):
        assert rows.sort_values("layer")["reported_m"].is_monotonic_decreasing
    contact = table[table["scene"] == "two_livers"].groupby("layer")["place_error_m"].mean()
    assert contact[30] < 0.5 * contact[0]


def test_times_and_counts_are_there(table):
    assert (table[["refit_ms", "contacts_ms", "frame_ms", "tests", "contacts"]].drop(columns="contacts") > 0).all(
        axis=None
    )
    assert (table["frame_ms"] >= table[["refit_ms", "contacts_ms"]].max(axis=1)).all()


def judged(depths, directions, velocities, truth, true):
    k = len(depths)
    pairs, ways, moving = np.repeat(np.arange(k), 2), np.array(directions), np.array(velocities)
    found = ContactPoints(
        pairs.reshape(-1, 2), np.zeros((k, 3)), ways.reshape(k, 3), np.array(depths), moving.reshape(k, 3), Counts(1, 0)
    )
    frame = Frame([], [], np.empty((0, 2)), 0.0, truth)
    return stopped_precision._judge(found, frame, np.array(true, dtype=np.int64).reshape(-1, 2))


def test_a_known_contact_is_judged_in_closed_form():
    truth = Overlap(np.array([0.0, 3.0, 4.0]), np.array([1.0, 0.0, 0.0]), 0.5, np.array([0.0, 0.0, 2.0]))
    row = judged([1.0, 1.0], [[1, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 0, 2]], truth, [[0, 0], [7, 7]])
    assert (row["false"], row["missed"]) == (1, 1)
    assert row["place"] == pytest.approx(5.0) and row["depth"] == pytest.approx(0.5)
    assert row["angle"] == pytest.approx(45.0) and row["velocity"] == pytest.approx(1.0)
    # (1, 1) / √2 of length 1, against (0.5, 0)
    assert row["response"] == pytest.approx((np.sqrt(0.5) - 0.5) ** 2 + 0.5)


def test_a_contact_where_there_is_none_costs_its_depth():
    row = judged([0.2], [[0, 0, 1]], [[0, 0, 0]], None, [])
    assert (row["reported"], row["false"], row["missed"]) == (True, 1, 0)
    assert row["response"] == pytest.approx(0.04) and "place" not in row


def test_no_contact_where_there_is_one_costs_the_truth():
    truth = Overlap(np.zeros(3), np.array([0.0, 1.0, 0.0]), 0.3, np.zeros(3))
    row = judged([], [], [], truth, [[0, 0]])
    assert not row["reported"] and row["missed"] == 1
    assert row["response"] == pytest.approx(0.09)
