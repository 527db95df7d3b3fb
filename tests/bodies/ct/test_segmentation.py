"""Segmentation by thresholds, its border, and masks drawn on some slices."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixtures.scans import drawn_shape

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.mesh_from_ct import cut_off
from palpate.bodies.ct.segmentation import fill_between, largest_filled, move_to_half_level, segment, undrawn_across
from palpate.bodies.ct.synthetic_abdomen import voxel_fractions
from palpate.errors import InputError
from palpate.studies.ct.imaging import dice

RANGE = (30, 120)


def scan(inside, spacing):
    """60 HU where ``inside(x, y, z)`` [m], 0 elsewhere, by partial volume along z as thick slices have it."""
    share, image = drawn_shape(inside, spacing)
    return replace(image, hu=(60 * share).astype(np.float32)), share >= 0.5


def ball(x, y, z):
    return x**2 + y**2 + z**2 < 0.04**2


def test_an_organ_at_the_border_is_known():
    image, truth = scan(lambda x, y, z: ball(x, y, z + 0.05), (0.002, 0.002, 0.002))
    mask = segment(image, RANGE)
    assert cut_off(image, mask, mask.shape, (0, 0, 0)) == ["the image towards the feet (48 cm²)"]
    assert dice(mask, truth) > 0.98


def test_what_cannot_be_found_is_reported():
    image, _ = scan(ball, (0.002, 0.002, 0.002))
    with pytest.raises(InputError, match=r"^image: no voxel lies between 200 and 300 HU once noise is"):
        segment(image, (200, 300))
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


RADIUS_M = 0.045


def balls(spacing_m, beside_hu, *others):
    """Make a ball of 60 HU and 45 mm radius and others (HU, centre, radius), with partial volume, in a background."""
    spacing = np.full(3, spacing_m)
    counts = np.full(3, round(0.12 / spacing_m))
    origin = -(counts - 1) / 2 * spacing
    hu = np.full(counts[::-1], float(beside_hu), dtype=np.float32)
    for value, centre, radius in [*others, (60, (0, 0, 0), RADIUS_M)]:
        hu += voxel_fractions(origin, spacing, counts, centre, (radius,) * 3, 0) * (value - hu)
    return Image(hu, origin, spacing)


CASES = [(m, hu, 0.0) for m in (0.002, 0.003) for hu in (-100, -800, 0, 400)] + [(0.002, -100, 15.0)]


@pytest.mark.parametrize(("spacing_m", "beside_hu", "noise_hu"), CASES)
def test_a_ball_keeps_its_volume_in_fat_air_water_and_bone_and_with_noise(spacing_m, beside_hu, noise_hu):
    """Blurring by a voxel alone takes 1.4 % at 3 mm: it moves a sphere's half level inward by the variance over 2 r."""
    image = balls(spacing_m, beside_hu)
    image.hu[:] += np.random.default_rng(0).normal(0, noise_hu, image.hu.shape)
    share = segment(image, RANGE).sum() * image.voxel_m3 / (4 / 3 * np.pi * RADIUS_M**3)
    assert share == pytest.approx(1, abs=0.025 if spacing_m == 0.003 else 0.015)


def test_it_does_not_run_into_a_neighbour_like_it():
    """A ball of 50 HU touches it in fat: the organ is as without it, except where they touch."""
    alone = segment(balls(0.002, -100), RANGE)
    image = balls(0.002, -100, (50, (0.052, 0, 0), 0.0075))
    touched = segment(image, RANGE)
    assert (touched & ~alone).sum() * image.voxel_m3 < 0.3e-6  # of a neighbour of 1.8 mL
    assert (alone & ~touched).sum() * image.voxel_m3 < 0.2e-6


def test_beside_its_like_the_border_stays():
    organ = np.zeros((20, 20, 20), dtype=bool)
    organ[:, :, :10] = True
    smooth = np.where(np.arange(20) < 12, 60.0, 40.0) * np.ones((20, 20, 1))
    assert np.array_equal(move_to_half_level(organ, smooth, np.full(3, 0.002), (30, 120)), organ)
    # and where the neighbour has another grey value, it moves to the start of the neighbour
    assert move_to_half_level(organ, smooth, np.full(3, 0.002), (50, 120)).sum() == 12 * 400


def only_every(mask, n, first, axis=0):
    """Keep each n-th slice of a mask, as if no other had been drawn."""
    drawn = np.zeros_like(mask)
    kept = (slice(None),) * axis + (slice(first, None, n),)
    drawn[kept] = mask[kept]
    return drawn


@pytest.fixture(scope="module")
def ball_drawn_slices():
    """A ball_drawn_slices of 30 mm radius in voxels of 1 × 1.5 × 2 mm, and its image."""
    spacing = np.array([0.001, 0.0015, 0.002])
    image = Image(np.zeros((50, 60, 90), dtype=np.int16), np.array([-0.0445, -0.04425, -0.049]), spacing, "scan")
    places = image.to_world(np.stack(np.indices(image.hu.shape), axis=-1))
    return image, np.linalg.norm(places - [0.001, 0.002, 0.0015], axis=-1) < 0.03


@pytest.mark.parametrize(("axis", "along", "first"), [("z", 0, 0), ("y", 1, 2), ("x", 2, 4)])
def test_a_ball_comes_back_from_every_fifth_slice_across_each_axis(ball_drawn_slices, axis, along, first):
    image, whole = ball_drawn_slices
    drawn = only_every(whole, 5, first, along)
    filled = fill_between(drawn, image, axis, Path("mask"))
    assert (filled & drawn).sum() == drawn.sum()
    kept = np.moveaxis(drawn, along, 0).any(axis=(1, 2))
    assert np.array_equal(np.moveaxis(filled, along, 0)[kept], np.moveaxis(whole, along, 0)[kept])
    assert dice(filled, whole) > 0.97
    assert filled.sum() == pytest.approx(whole.sum(), rel=0.02)


def test_it_ends_before_the_next_slice_that_would_have_been_drawn(ball_drawn_slices):
    image, whole = ball_drawn_slices
    filled = fill_between(only_every(whole, 6, 0), image, "z", Path("mask"))
    there = np.flatnonzero(filled.any(axis=(1, 2)))
    drawn = np.flatnonzero(only_every(whole, 6, 0).any(axis=(1, 2)))
    assert drawn[0] - 6 < there[0] < drawn[0] and drawn[-1] < there[-1] < drawn[-1] + 6


def test_slices_need_not_be_evenly_spaced_nor_end_inside_the_image(ball_drawn_slices):
    image, whole = ball_drawn_slices
    drawn = np.zeros_like(whole)
    for at in (12, 14, 20, 27, 29, 35):
        drawn[at] = whole[at]
    assert dice(fill_between(drawn, image, "z", Path("mask")), whole) > 0.95
    part = replace(image, hu=image.hu[20:])
    filled = fill_between(only_every(whole[20:], 4, 0), part, "z", Path("mask"))
    assert dice(filled, whole[20:]) > 0.98


def test_a_mask_of_single_slices_is_recognised_and_one_is_not_enough(ball_drawn_slices):
    image, whole = ball_drawn_slices
    one = np.zeros_like(whole)
    one[25] = whole[25]
    assert [undrawn_across(mask) for mask in (whole, np.zeros_like(whole), one)] == [None] * 3
    assert [undrawn_across(only_every(whole, 4, 1, along)) for along in range(3)] == ["z", "y", "x"]
    with pytest.raises(InputError, match=r"^mask: the mask has 1 slice\(s\) across z, and drawn_slices needs two at"):
        fill_between(one, image, "z", Path("mask"))
