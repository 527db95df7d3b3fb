"""Pictures of a CT show the organ where it is, in its classes' colours."""

import numpy as np
import pandas as pd
import pytest

from palpate.bodies.body import Material, nest
from palpate.bodies.ct.image import Image
from palpate.evaluation.table import columns
from palpate.figures import render, style
from palpate.figures.ct import ct_classes, ct_slices, ct_volume, node_mass


@pytest.fixture(scope="module")
def scan():
    """A cylinder of muscle in a skin, with a bone behind and a ball of organ in front of it, 0.08 m wide."""
    shape, spacing = (20, 40, 40), np.array([0.002, 0.002, 0.004])
    image = Image(np.full(shape, -1000, dtype=np.int16), -(np.array(shape[::-1]) - 1) / 2 * spacing, spacing)
    x, y, z = np.moveaxis(image.to_world(np.stack(np.indices(shape), axis=-1)), -1, 0)
    image.hu[np.hypot(x, y) < 0.036] = -100
    image.hu[np.hypot(x, y) < 0.032] = 50
    image.hu[np.hypot(x, y - 0.02) < 0.006] = 700
    mask = x**2 + (y + 0.008) ** 2 + z**2 < 0.018**2
    image.hu[mask] = 60
    return image, mask


def test_between_the_organ_and_anything_else_is_nothing_opaque_but_the_organ(scan):
    values = ct_classes.values(*scan)
    corners, _, opacities = zip(*ct_classes.CLASSES, strict=True)
    opaque = np.interp(values, corners, opacities)
    assert (values[scan[1]].mean() < -1600) and opaque[scan[1]].mean() > 0.5
    rim = ~scan[1] & (values < -300) & (scan[0].hu > -200)
    assert opaque[rim].max() <= 0.7
    assert ct_classes.values(scan[0], np.zeros_like(scan[1])).max() == 500


def test_ray_casting_shows_the_organ_bone_and_gaps_and_repeats(scan):
    image, mask = scan
    view = render.View(np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), np.zeros(3), 0.1, 0.1)
    pictures = []
    for shown in (mask, mask, np.zeros_like(mask)):
        with render.Stage(100, 100) as stage:
            pictures.append(stage.picture(view, [lambda s, m=shown: s.volume(ct_volume._volume(image, m))]))
    assert np.array_equal(pictures[0], pictures[1])
    middle, corner = pictures[0][50, 50].astype(int), pictures[0][3, 3]
    assert middle[0] > 1.8 * middle[2] and (corner == 255).all()  # the organ is red, the gap is white
    covered = (np.abs(pictures[0].astype(int) - pictures[2]).max(axis=2) > 25).mean()
    assert covered == pytest.approx(np.pi * 0.018**2 / 0.1**2, rel=0.3)
    bone = pictures[2][50, 50].astype(int)
    assert np.ptp(bone) < np.ptp(middle) / 2  # grey-white, through muscle
    side = pictures[2][50, 25]
    assert side.min() > bone.min()  # muscle and skin alone let more of the white ground through


def test_the_outline_is_where_the_organ_is(scan):
    figure = ct_slices.draw(*scan, "ball")
    axial, coronal, sagittal = figure.axes
    assert axial.yaxis_inverted() and not coronal.yaxis_inverted()
    for axis, across, up in ((axial, 0.0, -8.0), (coronal, 0.0, 0.0), (sagittal, -8.0, 0.0)):
        ends = np.vstack([path.vertices for path in axis.collections[0].get_paths()])
        assert ends.mean(axis=0) == pytest.approx([across, up], abs=2.0)
        assert np.ptp(ends, axis=0) == pytest.approx([36, 36], abs=4.1)


def test_pictures_are_saved(scan, box, tmp_path):
    body = nest("ball", box([2, 2, 2], [0.03, 0.03, 0.03]), 1, np.arange(9), Material(3000.0, 0.3, 1000.0))
    figure = ct_volume.draw(*scan, body)
    assert len([axis for axis in figure.axes if axis.images]) == 3
    assert figure.axes[2].get_xlabel() == f"fine surface: {len(body.fine.surface)} nodes"
    style.save(figure, tmp_path / "ct_volume_ball")


def test_masses_are_drawn_with_and_without_the_rim(tmp_path):
    rows = [["ball", 600, 180, 1.15, 1065.0, 0.02, -0.09], ["ball", 9000, 2000, 1.13, 1072.0, 0.001, -0.01]]
    table = pd.DataFrame(rows, columns=columns("node_mass"))
    deviation = node_mass.draw(table).axes[0]
    dashed, plain = deviation.lines[:2]
    assert plain.get_ydata().tolist() == [2.0, 0.1] and dashed.get_ydata().tolist() == [-9.0, -1.0]
