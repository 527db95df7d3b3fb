"""Segmentation by threshold: bridges, hollows, noise and thick slices."""

import numpy as np
import pytest

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.mesh_from_ct import cut_off
from palpate.bodies.ct.segmentation import largest_filled, segment
from palpate.errors import InputError

RANGE = {"threshold_hu": [30, 120]}


def dice(first, second):
    return 2 * (first & second).sum() / (first.sum() + second.sum())


def scan(inside, spacing, half=0.06):
    """60 HU where ``inside(x, y, z)`` [m], 0 elsewhere, by partial volume along z as thick slices have it."""
    spacing = np.array(spacing)
    counts = np.round(2 * half / spacing).astype(int)
    origin = -(counts - 1) / 2 * spacing
    x, y, z = (o + s * np.arange(n) for o, s, n in zip(origin, spacing, counts, strict=True))
    offsets = (np.arange(10) - 4.5) / 10 * spacing[2]
    share = sum(inside(x, y[:, None], (z + dz)[:, None, None]).astype(float) for dz in offsets) / 10
    return Image((60 * share).astype(np.float32), origin, spacing), share >= 0.5


def ball(x, y, z):
    return x**2 + y**2 + z**2 < 0.04**2


@pytest.mark.parametrize("spacing", [(0.002, 0.002, 0.002), (0.001, 0.001, 0.01)], ids=["even", "ten to one"])
def test_a_ball_comes_back(spacing):
    image, truth = scan(ball, spacing)
    mask = segment(image, RANGE)
    assert dice(mask, truth) > 0.98
    assert mask.sum() * image.voxel_m3 == pytest.approx(4 / 3 * np.pi * 0.04**3, rel=0.01)
    assert cut_off(image, mask, mask.shape, (0, 0, 0)) == []


def test_noise_and_a_hollow_are_filled():
    image, truth = scan(ball, (0.002, 0.002, 0.002))
    noisy = image.hu + np.random.default_rng(0).normal(0, 20, image.hu.shape)
    noisy[27:33, 27:33, 27:33] = -50
    mask = segment(Image(noisy.astype(np.float32), image.origin_m, image.spacing_m), RANGE)
    assert dice(mask, truth) > 0.98
    assert mask[27:33, 27:33, 27:33].all()


def test_a_bridge_to_a_neighbour_is_cut():
    def two(x, y, z):
        bridge = (x**2 + y**2 < 0.004**2) & (np.abs(z) < 0.05)
        neighbour = x**2 + y**2 + (z - 0.049) ** 2 < 0.009**2
        return (x**2 + y**2 + (z + 0.01) ** 2 < 0.03**2) | bridge | neighbour

    image, _ = scan(two, (0.001, 0.001, 0.002))
    volume = segment(image, RANGE).sum() * image.voxel_m3
    assert volume == pytest.approx(4 / 3 * np.pi * 0.03**3, rel=0.02)


def test_an_organ_at_the_border_is_known():
    image, truth = scan(lambda x, y, z: ball(x, y, z + 0.05), (0.002, 0.002, 0.002))
    mask = segment(image, RANGE)
    assert cut_off(image, mask, mask.shape, (0, 0, 0)) == ["the image towards the feet (48 cm²)"]
    assert dice(mask, truth) > 0.98


def test_what_cannot_be_found_is_reported():
    image, _ = scan(ball, (0.002, 0.002, 0.002))
    with pytest.raises(
        InputError, match=r"^image: no voxel lies between 200 and 300 HU once noise is bl.*are 0 to 60\); widen"
    ):
        segment(image, {"threshold_hu": [200, 300]})
    thin, _ = scan(lambda x, y, z: (np.abs(x) < 0.003) & ball(x, y, z), (0.002, 0.002, 0.002))
    with pytest.raises(InputError, match="nothing between 30 and 120 HU is thicker than 10 mm"):
        segment(thin, RANGE)
    zeros = Image(-np.zeros((10, 10, 10), dtype=np.float32), np.zeros(3), np.full(3, 0.002))
    with pytest.raises(InputError, match=r"no voxel lies between .*\(before, they are 0 to 0\)"):
        segment(zeros, RANGE)


def test_whole_keeps_the_largest_piece_without_its_hollow():
    mask = np.zeros((9, 9, 20), dtype=bool)
    mask[2:7, 2:7, 2:7] = True
    mask[4, 4, 4] = False
    mask[3:5, 3:5, 12:14] = True
    found = largest_filled(mask)
    assert found.sum() == 125
    assert found[4, 4, 4]
