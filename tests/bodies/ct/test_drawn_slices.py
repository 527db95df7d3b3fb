"""Masks that are drawn on every n-th slice come back, of round bodies and of a real liver."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from palpate.bodies.ct.image import Image, read, read_mask
from palpate.bodies.ct.scan_of import fill_between, undrawn_across
from palpate.errors import InputError

SHARED = Path(__file__).parents[3].parent / "shared" / "ct"


def dice(first, second):
    return 2 * (first & second).sum() / (first.sum() + second.sum())


def only_every(mask, n, first, axis=0):
    """Keep each n-th slice of a mask, as if no other had been drawn."""
    drawn = np.zeros_like(mask)
    kept = [slice(None)] * 3
    kept[axis] = slice(first, None, n)
    drawn[tuple(kept)] = mask[tuple(kept)]
    return drawn


@pytest.fixture(scope="module")
def ball():
    """A ball of 30 mm radius in voxels of 1 × 1.5 × 2 mm, and its image."""
    spacing = np.array([0.001, 0.0015, 0.002])
    image = Image(np.zeros((50, 60, 90), dtype=np.int16), np.array([-0.0445, -0.04425, -0.049]), spacing, "scan")
    places = image.to_world(np.stack(np.indices(image.hu.shape), axis=-1))
    return image, np.linalg.norm(places - [0.001, 0.002, 0.0015], axis=-1) < 0.03


@pytest.mark.parametrize(("axis", "along"), [("z", 0), ("y", 1), ("x", 2)])
@pytest.mark.parametrize("first", [0, 2, 4])
def test_a_ball_comes_back_from_every_fifth_slice_across_each_axis(ball, axis, along, first):
    image, whole = ball
    drawn = only_every(whole, 5, first, along)
    filled = fill_between(drawn, image, axis, Path("mask"))
    assert (filled & drawn).sum() == drawn.sum()
    kept = np.moveaxis(drawn, along, 0).any(axis=(1, 2))
    assert np.array_equal(np.moveaxis(filled, along, 0)[kept], np.moveaxis(whole, along, 0)[kept])
    assert dice(filled, whole) > 0.97
    assert filled.sum() == pytest.approx(whole.sum(), rel=0.02)


def test_it_ends_before_the_next_slice_that_would_have_been_drawn(ball):
    image, whole = ball
    filled = fill_between(only_every(whole, 6, 0), image, "z", Path("mask"))
    there = np.flatnonzero(filled.any(axis=(1, 2)))
    drawn = np.flatnonzero(only_every(whole, 6, 0).any(axis=(1, 2)))
    assert drawn[0] - 6 < there[0] < drawn[0] and drawn[-1] < there[-1] < drawn[-1] + 6


def test_slices_need_not_be_evenly_spaced_nor_end_inside_the_image(ball):
    image, whole = ball
    drawn = np.zeros_like(whole)
    for at in (12, 14, 20, 27, 29, 35):
        drawn[at] = whole[at]
    assert dice(fill_between(drawn, image, "z", Path("mask")), whole) > 0.95
    part = replace(image, hu=image.hu[20:])
    filled = fill_between(only_every(whole[20:], 4, 0), part, "z", Path("mask"))
    assert dice(filled, whole[20:]) > 0.98


@pytest.mark.skipif(not SHARED.is_dir(), reason="no shared CT beside the checkout")
@pytest.mark.parametrize("first", range(5))
def test_a_real_liver_from_every_fifth_slice(first):
    image = read(SHARED / "ct_liver_crop.nii.gz")
    whole = read_mask(SHARED / "liver_mask_crop.nii.gz", image)
    filled = fill_between(only_every(whole, 5, first), image, "z", Path("mask"))
    assert dice(filled, whole) >= 0.96
    assert filled.sum() == pytest.approx(whole.sum(), rel=0.02)


def test_a_mask_of_single_slices_is_recognised(ball):
    whole = ball[1]
    assert undrawn_across(whole) is None
    assert [undrawn_across(only_every(whole, 4, 1, along)) for along in range(3)] == ["z", "y", "x"]
    assert undrawn_across(np.zeros_like(whole)) is None
    one = np.zeros_like(whole)
    one[25] = whole[25]
    assert undrawn_across(one) is None


def test_one_slice_is_not_enough(ball):
    image, whole = ball
    one = np.zeros_like(whole)
    one[25] = whole[25]
    with pytest.raises(InputError, match=r"^mask: the mask has 1 slice\(s\) across z, and drawn_slices needs two at"):
        fill_between(one, image, "z", Path("mask"))
