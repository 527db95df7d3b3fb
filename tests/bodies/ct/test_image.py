"""Volumes and masks from files: one right-handed frame, labels, and what is refused."""

import gzip
import struct

import numpy as np
import pytest
from fixtures.scans import write

from palpate.bodies.ct.image import AIR_HU, Image, choose, read, read_mask
from palpate.errors import InputError

EVEN = (10.0, 10.0, 10.0)


@pytest.fixture
def scan():
    """40 x 30 x 20 voxels of water in air with one bright voxel, at (7, 5, 3)."""
    hu = np.full((20, 30, 40), -1000, dtype=np.int16)
    hu[5:15, 5:25, 5:35] = 0
    hu[3, 5, 7] = 900
    return hu


def brightest(image):
    return image.to_world(np.unravel_index(np.argmax(image.hu), image.hu.shape))


@pytest.mark.parametrize("suffix", [".nii.gz", ".nii", ".nrrd", ".mhd"])
def test_formats_agree_in_metres(tmp_path, scan, suffix):
    image = read(write(tmp_path / f"scan{suffix}", scan))
    assert np.array_equal(image.hu, scan)
    assert image.hu.dtype == np.int16
    assert np.allclose(image.spacing_m, [0.001, 0.002, 0.003], rtol=1e-6)
    assert np.allclose(brightest(image), [0.017, -0.010, 0.039], atol=1e-8)
    assert image.voxel_m3 == pytest.approx(6e-9, rel=1e-6)
    assert np.allclose(image.to_index(brightest(image)), [3, 5, 7])


def test_padding_is_air(tmp_path, scan):
    scan[:, :3] = -3024
    assert read(write(tmp_path / "scan.nii.gz", scan)).hu.min() == AIR_HU


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.zeros((4, 4, 4), dtype=np.int16), "every voxel is 0; give a CT in Hounsfield units."),
        (np.arange(64, dtype=np.int16).reshape(4, 4, 4), "no voxel is below 0 HU, so this is not a CT"),
        (np.zeros((4, 4), dtype=np.int16), "it is not a single volume of scalars"),
    ],
    ids=["zeros", "magnetic resonance", "flat"],
)
def test_an_image_that_is_not_a_ct_is_reported(tmp_path, values, message):
    path = write(tmp_path / "scan.nrrd", values)
    with pytest.raises(InputError) as caught:
        read(path)
    assert str(caught.value).startswith(f"{path}: {message}")


def test_missing_and_damaged_files_are_reported(tmp_path):
    (tmp_path / "broken.nrrd").write_text("NRRD0004\ntype: short\n")
    (tmp_path / "slice.dcm").write_text("")
    for name, said in (
        ("none.nii.gz", "this file does not exist"),
        ("broken.nrrd", "SimpleITK cannot read it"),
        ("slice.dcm", "for DICOM give the folder"),
    ):
        with pytest.raises(InputError, match=said):
            read(tmp_path / name)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_a_file_that_ends_too_early_or_was_changed_is_not_filled_with_zeros(tmp_path, scan, suffix):
    path = write(tmp_path / f"scan{suffix}", scan + np.random.default_rng(0).integers(0, 9, scan.shape, dtype=np.int16))
    whole = path.read_bytes()
    half = len(whole) // 2
    changed = whole[:half] + bytes([whole[half] ^ 255]) + whole[half + 1 :]  # noticed where it is packed
    for damaged in (whole[: len(whole) * 6 // 10], whole[:-1], whole[:300], changed)[: 4 if suffix == ".nii.gz" else 3]:
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"scan\.nii.*: the file is cut off or damaged; write or"):
            read(path)
        with pytest.raises(InputError, match="the file is cut off or damaged"):
            read_mask(path, Image(scan, np.zeros(3), np.ones(3)))


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".nrrd", ".mha"])
def test_a_voxel_that_is_not_a_number_is_not_taken_for_water(tmp_path, scan, suffix):
    hu = scan.astype(np.float64 if suffix == ".nii" else np.float32)
    hu[3, 3, 3] = np.nan
    with pytest.raises(InputError, match="it has voxels that are not finite numbers; fill them with air, -1024 HU"):
        read(write(tmp_path / f"scan{suffix}", hu))


def test_a_mask_follows_its_image(tmp_path, scan):
    mask = (scan > 500).astype(np.uint8)
    image = read(write(tmp_path / "scan.nii.gz", scan, direction=np.diag([-1, -1, 1])))
    found = read_mask(write(tmp_path / "mask.nrrd", mask, direction=np.diag([-1, -1, 1])), image)
    assert np.array_equal(found, image.hu > 500)


@pytest.mark.parametrize(
    ("change", "part", "what"),
    [
        ({"spacing": (1.0, 2.0, 3.1)}, np.s_[:], "voxels of 1×2×3.1 mm instead of 1×2×3"),
        ({"origin": (10.0, -19.0, 30.0)}, np.s_[:], "begins 1 mm away"),
        ({"direction": np.diag([1, -1, 1])}, np.s_[:], "begins 58 mm away"),
        ({}, np.s_[1:], "40×30×19 voxels instead of 40×30×20"),
    ],
    ids=["spacing", "origin", "direction", "shape"],
)
def test_a_mask_on_another_grid_is_reported(tmp_path, scan, change, part, what):
    image = read(write(tmp_path / "scan.nii.gz", scan))
    path = write(tmp_path / "mask.nii.gz", (scan[part] > -500).astype(np.uint8), **change)
    said = rf"mask\.nii\.gz: the mask is on another grid than .*: {what}; resample it to the image's grid\.$"
    with pytest.raises(InputError, match=said):
        read_mask(path, image)


def test_masks_without_or_with_many_labels_are_reported(tmp_path, scan):
    image = Image(scan, np.array([0.01, -0.02, 0.03]), np.array([0.001, 0.002, 0.003]))
    with pytest.raises(InputError, match="the mask is empty"):
        read_mask(write(tmp_path / "mask.nii.gz", np.zeros(scan.shape, dtype=np.uint8)), image)
    sentence = r"the mask has 2 labels: 2 \(36 mL\), 5 \(0\.006 mL\); choose with label, a number or a name or a list"
    with pytest.raises(InputError, match=sentence):
        read_mask(write(tmp_path / "mask.nii.gz", (2 * (scan > -500) + 3 * (scan > 500)).astype(np.uint8)), image)


NAMES = {number: f"organ_{number}" for number in range(1, 105)} | {5: "liver", 51: "heart"}


@pytest.fixture(scope="module")
def image():
    """1 mL voxels of water with a border of air."""
    hu = np.zeros((12, 14, 16), dtype=np.int16)
    hu[0] = hu[-1] = -1000
    return Image(hu, np.zeros(3), np.full(3, 0.01), "scan")


@pytest.fixture(scope="module")
def values(image):
    """104 labels: 5 in 30 voxels, 51 in 20 that touch them, 104 in two pieces, and each other one in a voxel."""
    values = np.zeros(image.hu.shape, dtype=np.uint8)
    values[2, 1, :] = 7
    values[2, 1, 1:] = 0
    rest = [number for number in NAMES if number not in (5, 7, 51, 104)]
    values[9].ravel()[: 2 * len(rest) : 2] = rest
    values[4, 2:5, 2:12] = 5
    values[5, 3:5, 2:12] = 51
    values[7, 2, 2:4] = values[7, 8, 2:4] = 104
    return values


def write_labels(path, values, names=None):
    """Write a mask as SimpleITK does, with names as TotalSegmentator (.nii, .nii.gz) or Slicer (.nrrd) adds them."""
    names, keys = names or {}, {}
    if path.suffix == ".nrrd":
        for n, (number, name) in enumerate(names.items()):
            keys |= {f"Segment{n}_LabelValue": str(number), f"Segment{n}_Name": name}
    write(path, values, EVEN, np.zeros(3), keys=keys)
    if names and path.suffix != ".nrrd":
        add_table(path, names)
    return path


def add_table(path, names):
    """Put the XML table that TotalSegmentator writes, an extension of its own, before the first voxel."""
    data = path.read_bytes()
    data = gzip.decompress(data) if path.suffix == ".gz" else data
    labels = [f'<Label Key="{n}" Red="1" Alpha="1"><![CDATA[{name}]]></Label>' for n, name in names.items()]
    head = '<?xml version="1.0" encoding="UTF-8"?> <CaretExtension><VolumeInformation Index="0"><LabelTable>'
    content = "\n".join([head, *labels, "</LabelTable></VolumeInformation></CaretExtension>\n   "]).encode()
    size = -(-(len(content) + 8) // 16) * 16
    extension = struct.pack("<ii", size, 0) + content.ljust(size - 8, b"\0")
    data = data[:108] + struct.pack("<f", 352 + size) + data[112:348] + b"\1\0\0\0" + extension + data[352:]
    path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else data)


@pytest.mark.parametrize("name", ["mask.nii.gz", "mask.nii", "mask.seg.nrrd"])
def test_a_label_is_taken_by_number_name_or_list(tmp_path, image, values, name):
    path = write_labels(tmp_path / name, values, NAMES)
    assert np.array_equal(read_mask(path, image, 5), values == 5)
    assert np.array_equal(read_mask(path, image, "liver"), values == 5)
    assert np.array_equal(read_mask(path, image, ["liver", 51]), (values == 5) | (values == 51))


@pytest.mark.parametrize(
    ("names", "label", "said"),
    [
        (NAMES, "livr", r"no voxel of label livr \(did you mean liver\?\); it has 104 labels: 5 liver \(30 mL\), "),
        (NAMES, 105, r"no voxel of label 105; it has 104 labels: "),
        (NAMES | {117: "brain"}, "brain", r"no voxel of label brain, though the file names it; it has 104 labels"),
        (None, "liver", r"label liver \(the file has no names, so give a number\)"),
    ],
)
def test_a_label_that_is_not_there_gets_the_near_name_and_the_list(tmp_path, image, values, names, label, said):
    with pytest.raises(InputError, match=said) as caught:
        read_mask(write_labels(tmp_path / "mask.nii.gz", values, names), image, label)
    assert str(caught.value).count(". ") == 0


def test_a_mask_of_one_label_needs_no_choice_and_checks_one(tmp_path, image, values):
    path = write_labels(tmp_path / "mask.nrrd", np.where(values == 5, 5, 0).astype(np.uint8))
    assert np.array_equal(read_mask(path, image), values == 5)
    assert np.array_equal(read_mask(path, image, 5), values == 5)
    with pytest.raises(InputError, match=r"no voxel of label 1; it has 1 label: 5 \(30 mL\)\.$"):
        read_mask(path, image, 1)


def test_values_that_are_not_whole_numbers_are_no_labels(tmp_path, image, values):
    path = write_labels(tmp_path / "mask.nii.gz", (values / 2).astype(np.float32))
    with pytest.raises(InputError, match="its values are not whole numbers, so they are not labels; give a mask with"):
        read_mask(path, image)


def test_an_image_and_its_mask_that_change_places_are_told_so(tmp_path, scan, image, values):
    with pytest.raises(
        InputError, match=r"as of a mask and not of an image; give the image first, and then the mask\.$"
    ):
        read(write_labels(tmp_path / "mask.nii.gz", np.repeat(values, 9, axis=0)))
    with pytest.raises(InputError, match="it has values below 0, as a CT has and no mask; give the CT first"):
        choose(tmp_path / "scan.nii.gz", scan, {}, None, image.voxel_m3)


@pytest.mark.parametrize("shift_mm", [0.0, 4.0])
def test_a_segmentation_cropped_by_slicer_is_put_in_its_place(tmp_path, image, values, shift_mm):
    origin, offset = [20.0 + shift_mm, 10.0, 30.0], {"Segmentation_ReferenceImageExtentOffset": "2 1 3"}
    path = write(tmp_path / "cropped.seg.nrrd", values[3:10, 1:, 2:], EVEN, origin, keys=offset)
    if shift_mm:
        with pytest.raises(InputError, match="is on another grid than scan"):
            read_mask(path, image, 5)
    else:
        assert np.array_equal(read_mask(path, image, 5), values == 5)


def test_overlapping_segments_are_refused(tmp_path, image, values):
    layers, named = np.stack([values, values], axis=-1), {"Segment0_Name": "liver"}
    path = write(tmp_path / "two.seg.nrrd", layers, keys=named, isVector=True)
    with pytest.raises(InputError, match=r"two\.seg\.nrrd: its segments overlap and lie in 2 layers; export those to"):
        read_mask(path, image, "liver")
