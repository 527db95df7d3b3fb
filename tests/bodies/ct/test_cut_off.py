"""Where an image ends inside an organ, and how much of the organ's surface is cut."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.ct.image import AIR_HU, Image
from palpate.bodies.ct.mesh_from_ct import cut_off

SPACING = np.array([0.001, 0.002, 0.005])


@pytest.fixture
def image() -> Image:
    return Image(np.zeros((10, 20, 30), dtype=np.int16), np.zeros(3), SPACING, "scan")


def said(image, box, whole=None, start=(0, 0, 0)):
    mask = np.zeros(image.hu.shape, dtype=bool)
    mask[box] = True
    return cut_off(image, mask, whole or mask.shape, start)


@pytest.mark.parametrize(
    ("box", "where"),
    [
        (np.s_[2:8, 5:15, 5:25], []),
        (np.s_[0:8, 5:15, 5:25], ["the image towards the feet (4 cm²)"]),  # 10 × 2 mm by 20 × 1 mm
        (np.s_[2:, 5:15, 5:25], ["the image towards the head (4 cm²)"]),
        (np.s_[2:8, :15, 5:25], ["the image towards the front (6 cm²)"]),  # 6 × 5 mm by 20 × 1 mm
        (np.s_[2:8, 5:, 5:25], ["the image towards the back (6 cm²)"]),
        (np.s_[2:8, 5:15, :25], ["the image towards the right (6 cm²)"]),  # 6 × 5 mm by 10 × 2 mm
        (np.s_[2:8, 5:15, 5:], ["the image towards the left (6 cm²)"]),
        (np.s_[:, 5:15, 5:25], ["the image towards the feet (4 cm²)", "the image towards the head (4 cm²)"]),
    ],
)
def test_each_side_is_named_with_its_area(image, box, where):
    assert said(image, box) == where


def test_a_crop_is_told_from_the_image(image):
    box = np.s_[:, 5:15, 5:25]
    whole, start = (15, 20, 30), (5, 0, 0)
    assert [cut.partition(" towards")[0] for cut in said(image, box, whole, start)] == ["crop_m", "the image"]


def test_padding_beside_an_organ_cuts_it_and_the_air_of_a_lung_does_not(image):
    box = np.s_[2:8, 5:15, 5:25]
    image.hu[:, :, 25:] = AIR_HU
    assert said(image, box) == ["the padding around the scanned circle (6 cm²)"]
    assert said(replace(image, modality="mri"), box) == []
    image.hu[:, :, 25:] = AIR_HU + 60
    assert said(image, box) == []
