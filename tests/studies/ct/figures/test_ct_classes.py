"""The classification makes nothing opaque between the organ and its neighbours."""

from dataclasses import replace

import numpy as np

from palpate.studies.ct import figures


def test_between_the_organ_and_anything_else_is_nothing_opaque_but_the_organ(scan):
    values = figures.values(*scan)
    corners, _, opacities = zip(*figures.CLASSES, strict=True)
    opaque = np.interp(values, corners, opacities)
    assert (values[scan[1]].mean() < -1600) and opaque[scan[1]].mean() > 0.5
    rim = ~scan[1] & (values < -300) & (scan[0].hu > -200)
    assert opaque[rim].max() <= 0.7
    assert figures.values(scan[0], np.zeros_like(scan[1])).max() == 500


def test_an_mri_shows_no_bone_and_no_air(scan):
    """Its grey values have no unit: what is brighter than the background is between skin and muscle."""
    image, mask = scan
    mri = replace(image, hu=(image.hu + 1100).astype(np.int16), modality="mri")
    corners, _, opacities = zip(*figures.CLASSES, strict=True)
    opaque = np.interp(figures.values(mri, np.zeros_like(mask)), corners, opacities)
    assert (opaque[image.hu < -900] == 0).all() and 0 < opaque[image.hu > -200].max() < 0.02
    assert figures.values(mri, mask)[mask].mean() < -1600
