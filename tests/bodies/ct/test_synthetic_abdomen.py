"""The synthetic abdomen against its own truth."""

import numpy as np
import pytest

from palpate.bodies.ct.masses import voxel_mass
from palpate.bodies.ct.segmentation import segment
from palpate.bodies.ct.synthetic_abdomen import SPACING_M, abdomen, voxel_fractions


@pytest.mark.parametrize("turn", [0, 0.35])
def test_shares_of_voxels_add_up_to_the_volume_of_an_ellipsoid(turn):
    spacing, axes = np.array([0.008, 0.006, 0.012]), (0.05, 0.03, 0.04)
    fraction = voxel_fractions(np.full(3, -0.07), spacing, np.array([19, 24, 12]), (0.002, 0.001, 0), axes, turn)
    assert fraction.min() == 0
    assert fraction.max() == 1
    assert fraction.sum() * np.prod(spacing) == pytest.approx(4 / 3 * np.pi * np.prod(axes), rel=3e-3)


@pytest.mark.parametrize("spacing", [SPACING_M, pytest.param((0.0015, 0.0015, 0.005), marks=pytest.mark.slow)])
def test_the_default_pipeline_finds_the_liver(spacing):
    image, truth = abdomen(spacing_m=spacing)
    mask = segment(image, (30, 120))
    assert mask.sum() * image.voxel_m3 == pytest.approx(truth["volume_m3"], rel=0.01)
    assert voxel_mass(image, mask) == pytest.approx(truth["mass_kg"], rel=0.01)
