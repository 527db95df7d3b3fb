"""Errors of stopped trees are those of their volumes; whole trees have none but those of triangles."""

import numpy as np
import pytest
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from palpate.bodies.simple_shapes import box
from palpate.bodies.surfaces.remesh import fibonacci_sphere, triangulate
from palpate.bodies.surfaces.solid import sample
from palpate.collision.contact_points import Contacts
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import Counts
from palpate.studies.brute_force import crossing
from palpate.studies.collision import stopped_precision
from palpate.studies.collision.settings import Apart, Stopped
from palpate.studies.collision.stopped_precision import Frame, Overlap, distance, overlap
from palpate.studies.prescribed_motions import two_bodies

FRAMES = 5


@pytest.fixture(scope="module")
def table():
    done = []
    found = stopped_precision.measure(Stopped(frames=FRAMES, layers=[0, 4, 30], depths=[[1, 1]]), 0, done.append)
    assert done == ["two_livers", "instrument_press", "instrument_approach", "livers_apart"]
    return found


def test_nothing_is_missed_and_whole_trees_report_nothing_false(table):
    assert len(table) == 4 * 3 * 4 and table.groupby("scene")["exact"].sum().tolist() == [3] * 4
    assert (table["missed_pairs"] == 0).all()
    whole = table[table["exact"]]
    assert whole["layer"].isna().all()
    assert (whole[["false_pairs", "false_frames", "reported_m"]] == 0).all(axis=None)
    assert (table[["refit_ms", "contacts_ms", "frame_ms", "tests"]] > 0).all(axis=None)
    assert (table["frame_ms"] >= table[["refit_ms", "contacts_ms"]].max(axis=1)).all()


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


def judged(depths, directions, velocities, truth, true):
    k = len(depths)
    pairs = np.repeat(np.arange(k), 2).reshape(-1, 2)
    ways, moving = (np.reshape(vectors, (k, 3)) for vectors in (directions, velocities))
    found = Contacts(pairs, np.zeros((k, 3)), ways, np.array(depths), moving, Counts(1, 0))
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


CUBE = box([1.0, 1.0, 1.0], [1, 1, 1])


def ball(count, radius, centre):
    sphere = fibonacci_sphere(count)
    return radius * sphere + centre, triangulate(sphere)


def test_distance_of_turned_cubes_whose_faces_look_at_each_other():
    for seed in range(5):
        turn = Rotation.random(random_state=np.random.default_rng(seed))
        # far from any node: the nearest nodes are 0.5 apart, the faces 0.01
        one, other = CUBE.nodes * [1, 4, 4], np.add(CUBE.nodes, [1.01, 1.5, 1.5])
        points = [turn.apply(one), turn.apply(other)]
        trees = [Tree(at, CUBE.triangles, "sphere") for at in points]
        assert distance(points, trees) == pytest.approx(0.01, rel=1e-9)
        assert distance([points[0], points[1] + turn.apply([-0.1, 0.0, 0.0])], trees) == 0.0


def test_the_overlap_of_two_balls_is_a_lens():
    # radii 1 and 0.6, centres 1.4 apart along a tilted axis: 0.2 deep
    way = np.array([2.0, -1.0, 0.5]) / np.linalg.norm([2.0, -1.0, 0.5])
    (a, one), (b, other) = ball(2500, 1.0, np.zeros(3)), ball(2500, 0.6, 1.4 * way)
    velocities = [np.tile([1.0, 0.0, 0.0], (len(a), 1)), np.tile([0.0, 3.0, 0.0], (len(b), 1))]
    found = overlap([a, b], velocities, [one, other])
    assert found.depth == pytest.approx(0.2, rel=0.02)
    # a has to move away from b
    assert found.direction == pytest.approx(-way, abs=0.01)
    assert found.place @ way == pytest.approx(0.9, abs=0.02)
    assert np.linalg.norm(found.place - found.place @ way * way) < 0.01
    assert found.velocity.tolist() == [1.0, -3.0, 0.0]
    back = overlap([b, a], velocities[::-1], [other, one])
    assert back.depth == pytest.approx(found.depth, rel=1e-6)
    assert back.direction == pytest.approx(-found.direction, abs=1e-6)


def test_bodies_apart_have_no_overlap_and_one_that_is_wholly_inside_another_has():
    (a, one), (b, other), (c, third) = (
        ball(800, 1.0, np.zeros(3)), ball(300, 0.6, [1.7, 0.0, 0.0]), ball(300, 0.2, [0.7, 0.0, 0.0])
    )  # fmt: skip
    assert overlap([a, b], [np.zeros_like(a), np.zeros_like(b)], [one, other]) is None
    found = overlap([a, c], [np.zeros_like(a), np.zeros_like(c)], [one, third])
    # the far side of the small ball is half way in
    assert found.depth == pytest.approx(0.5, rel=0.03)
    assert found.direction == pytest.approx([-1.0, 0.0, 0.0], abs=0.1)


GAPS = [0.004, 0.05]


@pytest.fixture(scope="module")
def apart_table():
    done = []
    found = stopped_precision.measure_apart(Apart(gaps_m=GAPS, placements=3), 0, [[1, 1]], seed=1, report=done.append)
    assert done == ["two_livers", "instrument"]
    return found


@pytest.mark.slow
def test_placed_bodies_have_the_gap():
    for bodies in two_bodies(0).values():
        for gap, points in stopped_precision._place(bodies, GAPS, np.random.default_rng(2)):
            # dense points of both surfaces: no nearer than the gap, and not much farther
            dense = [sample(at, cells, 0.002)[0] for at, (_, cells) in zip(points, bodies, strict=True)]
            nearest = KDTree(dense[0]).query(dense[1])[0].min()
            assert gap <= nearest < 1.01 * gap + 0.002
            assert not len(crossing(points, [cells for _, cells in bodies]))


def test_no_structure_finds_a_crossing_and_wider_gaps_take_fewer_tests(apart_table):
    assert (apart_table["extra_pairs"] == 0).all() and (apart_table["placements"] == 3).all()
    own = apart_table[~apart_table["rival"]]
    assert (own[["query_ms", "refit_ms", "frame_ms"]] > 0).all(axis=None)
    assert own["roots_overlap"].between(0, 1).all()
    for _, rows in own.groupby(["bodies", "structure"]):
        tests = rows.set_index("gap_m")["node_tests"]
        assert 1 <= tests[GAPS[1]] < tests[GAPS[0]]
        # where the roots are apart, the first test suffices
        alone = rows[rows["roots_overlap"] == 0.0]
        assert (alone["node_tests"] == 1).all()
