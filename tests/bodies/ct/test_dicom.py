"""DICOM folders: three traps in real ones, and what is refused in synthetic ones."""

from pathlib import Path

import numpy as np
import pytest
from fixtures.scans import write_slice

from palpate.bodies.ct.image import read
from palpate.errors import InputError

SHARED = Path(__file__).parents[3].parent / "shared" / "ct"
real = pytest.mark.skipif(not SHARED.is_dir(), reason="no shared CT beside the checkout")


@pytest.fixture
def write(tmp_path):
    """Write 8 x 6 slices of -1000 + 10 z HU at heights z [mm]; returns their folder."""

    def slices(heights, modality="CT", series="1.2.3", shift=0.0, size=(8, 6), prefix=""):
        # the last tags are of a gantry that was tilted, though slices may have been made upright since, and of HU
        more = {"0018|0050": "9", "0018|1120": "20", "0028|1052": "-1024", "0028|1053": "1", "modality": modality}
        for number, z in enumerate(heights):
            values, place = np.full(size[::-1], -1000 + 10 * round(z), dtype=np.int16), (shift * number, 0, z)
            path, across = tmp_path / f"{prefix}{number}.dcm", (1, 0, 0, 0, 1, 0)
            write_slice(path, values, (0.5, 0.75), place, across, number, series, **more)
        return tmp_path

    return slices


def test_slices_are_ordered_by_position_and_spaced_by_it(write):
    folder = write([4, 0, 6, 2, 8])
    (folder / "README.txt").write_text("not a slice")
    image = read(folder)
    assert image.hu[:, 0, 0].tolist() == [-1000, -980, -960, -940, -920]
    assert np.allclose(image.spacing_m, [0.0005, 0.00075, 0.002])
    assert np.allclose(image.origin_m, 0)


@pytest.mark.parametrize(
    ("heights", "changes", "message"),
    [
        ([0, 2, 6, 8, 10], {}, ": a slice is missing or out of place, since 1.dcm and 2.dcm are 4 mm apart and most"),
        ([0, 2, 2, 4], {}, ": 1.dcm and 2.dcm lie at the same place; keep one of them."),
        ([0, 2, 4], {"modality": "MR"}, "/0.dcm: its modality is MR;"),
        ([0], {}, ": it holds a single slice; give the whole series."),
        ([0, 2, 4], {"shift": 0.5}, ": its axes are sheared by 14°, as by a tilted gantry;"),
    ],
    ids=["missing", "twice", "no CT", "single", "tilted"],
)
def test_an_incomplete_series_is_reported(write, heights, changes, message):
    folder = write(heights, **changes)
    with pytest.raises(InputError, match=f"^{folder}{message}"):
        read(folder)


def test_mixed_series_and_foreign_slices_are_reported(write, tmp_path):
    write([0, 2, 4])
    write([6], size=(9, 6), prefix="other")
    with pytest.raises(InputError, match=r"other0\.dcm: its pixels or orientation differ from 0\.dcm's; remove it\."):
        read(tmp_path)
    write([6], series="1.2.4", prefix="other")
    with pytest.raises(InputError, match="it holds 2 series; put the one to use in a folder of its own"):
        read(tmp_path)


@pytest.mark.parametrize(
    ("number", "size", "kept"),
    [(number, (8, 6), slice(kept)) for number in (1, 3) for kept in (0, 100, 300)] + [(2, (80, 60), slice(-2000))],
)
def test_a_broken_slice_or_one_without_pixels_is_named_and_not_called_missing(write, number, size, kept):
    broken = write([0, 2, 4, 6], size=size) / f"{number}.dcm"
    broken.write_bytes(broken.read_bytes()[kept])
    with pytest.raises(InputError, match=rf"{number}\.dcm: it cannot be read as a DICOM image, and seems"):
        read(broken.parent)


def test_a_position_that_is_not_a_number_is_reported(write):
    folder = write([0, 2.5, 5])
    damaged = (folder / "1.dcm").read_bytes()
    assert b"\\0\\2.5" in damaged
    (folder / "1.dcm").write_bytes(damaged.replace(b"\\0\\2.5", b"\\0\\2x5"))
    with pytest.raises(InputError, match=r"1\.dcm: it is not one slice with a position, orientation and"):
        read(folder)


def test_a_folder_without_slices_is_reported(tmp_path):
    (tmp_path / "README.txt").write_text("nothing here")
    with pytest.raises(InputError, match="no file in it is a DICOM image"):
        read(tmp_path)


@real
def test_the_distance_of_jpeg2000_slices_is_2_mm_whatever_the_thickness_says():
    image = read(SHARED / "dicom-jpeg2000")
    assert image.hu.shape == (20, 512, 512)
    assert np.allclose(image.spacing_m, [0.0009765625, 0.0009765625, 0.002])
    # the last file is the lowest slice
    assert np.allclose(image.origin_m, [-0.24951171875, -0.43751171875, -0.8045])
