"""The classification makes nothing opaque between the organ and its neighbours."""

import numpy as np

from palpate.figures.ct import ct_classes


def test_between_the_organ_and_anything_else_is_nothing_opaque_but_the_organ(scan):
    values = ct_classes.values(*scan)
    corners, _, opacities = zip(*ct_classes.CLASSES, strict=True)
    opaque = np.interp(values, corners, opacities)
    assert (values[scan[1]].mean() < -1600) and opaque[scan[1]].mean() > 0.5
    rim = ~scan[1] & (values < -300) & (scan[0].hu > -200)
    assert opaque[rim].max() <= 0.7
    assert ct_classes.values(scan[0], np.zeros_like(scan[1])).max() == 500
