"""Ray casting shows the organ, bone and gaps in the colours of their classes."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.report import render, style
from palpate.studies.ct import figures


def test_ray_casting_shows_the_organ_bone_and_gaps_and_repeats(scan):
    image, mask = scan
    view = render.View(np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), np.zeros(3), 0.1, 0.1)
    pictures = []
    for shown in (mask, mask, np.zeros_like(mask)):
        with render.Stage(100, 100) as stage:
            pictures.append(stage.picture(view, [lambda s, m=shown: s.volume(figures._volume(image, m))]))
    assert np.array_equal(pictures[0], pictures[1])
    middle, corner = pictures[0][50, 50].astype(int), pictures[0][3, 3]
    assert middle[0] > 1.8 * middle[2] and (corner == 255).all()  # the organ is red, the gap is white
    covered = (np.abs(pictures[0].astype(int) - pictures[2]).max(axis=2) > 25).mean()
    assert covered == pytest.approx(np.pi * 0.018**2 / 0.1**2, rel=0.3)
    bone = pictures[2][50, 50].astype(int)
    assert np.ptp(bone) < np.ptp(middle) / 2  # grey-white, through muscle
    side = pictures[2][50, 25]
    assert side.min() > bone.min()  # muscle and skin alone let more of the white ground through


def test_pictures_are_saved(scan, box, tmp_path):
    body = nest("ball", box([2, 2, 2], [0.03, 0.03, 0.03]), 1, np.arange(9), Material(3000.0, 0.3, 1000.0))
    figure = figures.draw_ct_volume_rendering(*scan, body)
    assert len([axis for axis in figure.axes if axis.images]) == 3
    assert figure.axes[2].get_xlabel() == f"fine surface: {len(body.fine.surface)} nodes"
    style.save(figure, tmp_path / "ct_volume_ball")
