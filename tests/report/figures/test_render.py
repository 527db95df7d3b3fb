"""Pictures show what they should, to scale."""

import numpy as np
import pytest

from palpate.report import render


@pytest.mark.parametrize("normal", [*np.eye(3), *-np.eye(3)])
def test_the_camera_is_orthonormal_and_never_behind_the_contact(body, normal):
    axes = render.directions(body.coarse.nodes, normal)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    assert axes[2] @ normal > 0.1
    assert abs(axes[0, 0]) > 0.8  # the beam's long side runs across


def test_the_frame_holds_all_points(body):
    axes = render.directions(body.coarse.nodes, np.array([0.0, 1, 0]))
    view = render.frame(axes, [body.coarse.nodes, body.coarse.nodes + 0.1])
    points = (np.vstack([body.coarse.nodes, body.coarse.nodes + 0.1]) - view.centre) @ axes.T
    assert abs(points[:, 0]).max() < view.width / 2
    assert abs(points[:, 1]).max() < view.height / 2


def test_a_box_seen_from_the_front_covers_its_area_and_the_picture_repeats(body):
    fine = body.fine
    view = render.View(np.eye(3), np.array([0.1, 0.025, 0.025]), 0.24, 0.12)
    pictures = []
    for _ in range(2):
        with render.Stage(240, 120) as stage:
            actor = [lambda s: s.surface(fine.nodes, fine.triangles, None, None, None)]
            pictures.append(stage.picture(view, actor))
    assert pictures[0].shape == (120, 240, 3)
    grey = pictures[0].mean(axis=2)
    covered = (grey < (grey[60, 120] + 255) / 2).mean()
    assert covered == pytest.approx(0.2 * 0.05 / (0.24 * 0.12), rel=0.03)
    assert np.array_equal(*pictures)
