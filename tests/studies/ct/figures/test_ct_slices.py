"""Slices show the outline of the organ at its place."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.studies.ct import figures


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
