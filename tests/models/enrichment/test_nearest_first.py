"""Orders are by distance, and ties are broken the same way whatever the last digits say."""

import numpy as np
import pytest

from palpate.models.enrichment.features import body_axis, contact_frame, levels, nearest_first, nearest_first_framed


def test_levels_join_only_what_is_close():
    values = np.array([3.0, 1.0, 1.0 + 1e-12, 2.0, 3.0 - 1e-12])
    assert levels(values, 1e-9).tolist() == [2, 0, 0, 1, 2]


def test_nearest_come_first():
    points = np.random.default_rng(0).normal(size=(200, 3))
    order = nearest_first(points, points[17], 1.0)
    assert order[0] == 17
    assert (np.diff(np.linalg.norm(points[order] - points[17], axis=1)) >= 0).all()


def test_ties_go_by_number_whatever_the_rounding():
    angles = np.arange(12) * np.pi / 6
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(12)])
    for seed in range(20):
        noise = 1e-15 * np.random.default_rng(seed).normal(size=ring.shape)
        assert nearest_first(ring + noise, np.zeros(3), 2.0).tolist() == list(range(12))


def test_framed_ties_do_not_depend_on_numbering():
    angles = np.arange(12) * np.pi / 6
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(12)])
    frame = contact_frame(np.array([0.0, 0.0, 1.0]), np.eye(3))
    wanted = ring[nearest_first_framed(ring, np.zeros(3), frame, 2.0)]
    for seed in range(20):
        random = np.random.default_rng(seed)
        shuffled = random.permutation(ring) + 1e-15 * random.normal(size=ring.shape)
        found = shuffled[nearest_first_framed(shuffled, np.zeros(3), frame, 2.0)]
        assert found == pytest.approx(wanted, abs=1e-12)


def test_frames_are_right_handed_and_keep_the_normal():
    random = np.random.default_rng(1)
    axis = body_axis(random.normal(size=(50, 3)) * [1, 2, 5])
    for normal in [*random.normal(size=(50, 3)), *np.eye(3), axis, -axis]:
        normal = normal / np.linalg.norm(normal)
        frame = contact_frame(normal, np.array([axis, axis]))
        assert frame.T @ frame == pytest.approx(np.eye(3), abs=1e-14)
        assert np.linalg.det(frame) == pytest.approx(1)
        assert frame[:, 0] == pytest.approx(normal)


@pytest.mark.parametrize("height", [0.1, 10.0])
def test_the_axis_of_a_body_of_revolution_is_its_own(height):
    angles = np.arange(24) * np.pi / 12
    points = np.array([[z, np.cos(a), np.sin(a)] for a in angles for z in np.linspace(0, height, 5)])
    assert body_axis(points) == pytest.approx([1, 0, 0], abs=1e-12)


def test_a_body_without_an_axis_gets_one():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    assert body_axis(corners).tolist() == [0, 0, 1]
