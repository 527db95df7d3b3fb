"""The classification makes nothing opaque between the organ and its neighbours."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.ct.image import Image
from palpate.report import render
from palpate.studies.ct import figures


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


def opacity(values):
    corners, _, opacities = zip(*figures.CLASSES, strict=True)
    return np.interp(values, corners, opacities)


def test_between_the_organ_and_anything_else_is_nothing_opaque_but_the_organ(scan):
    values = figures.values(*scan)
    opaque = opacity(values)
    assert (values[scan[1]].mean() < -1600) and opaque[scan[1]].mean() > 0.5
    rim = ~scan[1] & (values < -300) & (scan[0].hu > -200)
    assert opaque[rim].max() <= 0.7
    assert figures.values(scan[0], np.zeros_like(scan[1])).max() == 500


def test_an_mri_shows_no_bone_and_no_air(scan):
    """Its grey values have no unit: what is brighter than the background is between skin and muscle."""
    image, mask = scan
    mri = replace(image, hu=(image.hu + 1100).astype(np.int16), modality="mri")
    opaque = opacity(figures.values(mri, np.zeros_like(mask)))
    assert (opaque[image.hu < -900] == 0).all() and 0 < opaque[image.hu > -200].max() < 0.02
    assert figures.values(mri, mask)[mask].mean() < -1600


def test_the_outline_is_where_the_organ_is(scan):
    figure = figures.draw_ct_slices(*scan, "ball")
    axial, coronal, sagittal = figure.axes
    assert axial.yaxis_inverted() and not coronal.yaxis_inverted()
    for axis, across, up in ((axial, 0.0, -8.0), (coronal, 0.0, 0.0), (sagittal, -8.0, 0.0)):
        ends = np.vstack([path.vertices for path in axis.collections[0].get_paths()])
        assert ends.mean(axis=0) == pytest.approx([across, up], abs=2.0)
        assert np.ptp(ends, axis=0) == pytest.approx([36, 36], abs=4.1)


def test_an_mri_is_drawn_in_its_own_range(scan):
    mri = replace(scan[0], hu=(scan[0].hu + 1000).astype(np.int16), modality="mri")
    limits = figures.draw_ct_slices(mri, scan[1], "ball").axes[0].images[0].get_clim()
    assert limits == (0, np.percentile(mri.hu, 99))
    assert figures.draw_ct_slices(*scan, "ball").axes[0].images[0].get_clim() == (-160, 240)


def test_ray_casting_shows_the_organ_bone_and_gaps_and_repeats(scan):
    image, mask = scan
    view = render.View(np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), np.zeros(3), 0.1, 0.1)
    pictures = []
    for shown in (mask, mask, np.zeros_like(mask)):
        with render.Stage(100, 100) as stage:
            pictures.append(stage.picture(view, [lambda s, m=shown: s.volume(figures._volume(image, m))]).astype(int))
    organ, again, bare = pictures
    assert np.array_equal(organ, again)
    middle, bone = organ[50, 50], bare[50, 50]
    assert middle[0] > 1.8 * middle[2] and (organ[3, 3] == 255).all()  # the organ is red, the gap is white
    covered = (np.abs(organ - bare).max(axis=2) > 25).mean()
    assert covered == pytest.approx(np.pi * 0.018**2 / 0.1**2, rel=0.3)
    assert np.ptp(bone) < np.ptp(middle) / 2  # grey-white, through muscle
    assert bare[50, 25].min() > bone.min()  # muscle and skin alone let more of the white ground through
