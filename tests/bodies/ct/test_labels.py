"""Masks of many labels: which are there, what the file calls them, and one body of one or several."""

import gzip
import struct

import numpy as np
import pytest

from palpate.bodies.ct.image import Image, read_mask
from palpate.bodies.ct.labels import choose
from palpate.bodies.ct.mesh_from_ct import segment_entry
from palpate.errors import InputError

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


def write(path, values, names=None, order="<"):
    """Write a mask as SimpleITK does, with names as TotalSegmentator (.nii, .nii.gz) or Slicer (.nrrd) adds them."""
    import SimpleITK

    found = SimpleITK.GetImageFromArray(values)
    found.SetSpacing([10.0, 10.0, 10.0])
    for n, (number, name) in enumerate((names or {}).items()):
        if path.suffix == ".nrrd":
            found.SetMetaData(f"Segment{n}_LabelValue", str(number))
            found.SetMetaData(f"Segment{n}_Name", name)
    SimpleITK.WriteImage(found, str(path))
    if names and path.suffix != ".nrrd":
        add_table(path, names)
    return path


def add_table(path, names):
    """Put the XML table that TotalSegmentator writes, an extension of its own, before the first voxel."""
    data = path.read_bytes()
    data = gzip.decompress(data) if path.suffix == ".gz" else data
    lines = [
        f'<Label Key="{n}" Red="1" Green="0" Blue="0" Alpha="1"><![CDATA[{name}]]></Label>' for n, name in names.items()
    ]
    text = "\n".join(
        ['<?xml version="1.0" encoding="UTF-8"?> <CaretExtension><VolumeInformation Index="0"><LabelTable>', *lines]
    )
    content = f"{text}</LabelTable></VolumeInformation></CaretExtension>\n   ".encode()
    size = -(-(len(content) + 8) // 16) * 16
    extension = struct.pack("<ii", size, 0) + content.ljust(size - 8, b"\0")
    data = data[:108] + struct.pack("<f", 352 + size) + data[112:348] + b"\1\0\0\0" + extension + data[352:]
    path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else data)


@pytest.mark.parametrize("name", ["mask.nii.gz", "mask.nii", "mask.seg.nrrd"])
def test_a_label_is_taken_by_number_name_or_list(tmp_path, image, values, name):
    path = write(tmp_path / name, values, NAMES)
    assert np.array_equal(read_mask(path, image, 5), values == 5)
    assert np.array_equal(read_mask(path, image, "liver"), values == 5)
    assert np.array_equal(read_mask(path, image, ["liver", 51]), (values == 5) | (values == 51))


def test_many_labels_without_a_choice_are_listed_largest_first(tmp_path, image, values):
    with pytest.raises(InputError) as caught:
        read_mask(write(tmp_path / "mask.nii.gz", values, NAMES), image)
    assert str(caught.value) == (
        f"{tmp_path}/mask.nii.gz: the mask has 104 labels: 5 liver (30 mL), 51 heart (20 mL), 104 organ_104 (4 mL), "
        "1 organ_1 (1 mL), 2 organ_2 (1 mL), 3 organ_3 (1 mL), 4 organ_4 (1 mL), 6 organ_6 (1 mL) and 96 more; "
        "choose with label, a number or a name or a list of them to join."
    )


@pytest.mark.parametrize(
    ("names", "label", "said"),
    [
        (NAMES, "livr", r"no voxel of label livr \(did you mean liver\?\); it has 104 labels: 5 liver \(30 mL\), "),
        (NAMES, 105, r"no voxel of label 105; it has 104 labels: "),
        (NAMES, [5, 200], r"no voxel of label 200; it has 104 labels: "),
        (NAMES | {117: "brain"}, "brain", r"no voxel of label brain, though the file names it; it has 104 labels"),
        (
            None,
            "liver",
            r"label liver \(the file has no names, so give a number\); it has 104 labels: 5 \(30 mL\), 51 ",
        ),
    ],
)
def test_a_label_that_is_not_there_gets_the_near_name_and_the_list(tmp_path, image, values, names, label, said):
    with pytest.raises(InputError, match=said) as caught:
        read_mask(write(tmp_path / "mask.nii.gz", values, names), image, label)
    assert str(caught.value).count(". ") == 0


def test_a_mask_of_one_label_needs_no_choice_and_checks_one(tmp_path, image, values):
    path = write(tmp_path / "mask.nrrd", np.where(values == 5, 5, 0).astype(np.uint8))
    assert np.array_equal(read_mask(path, image), values == 5)
    assert np.array_equal(read_mask(path, image, 5), values == 5)
    with pytest.raises(InputError, match=r"no voxel of label 1; it has 1 label: 5 \(30 mL\)\.$"):
        read_mask(path, image, 1)


def test_labels_of_one_name_are_one_body(image, values):
    joined = choose("mask", values, {5: "lung", 51: "lung"}, "lung", image.voxel_m3)
    assert np.array_equal(joined, (values == 5) | (values == 51))


def test_values_that_are_not_whole_numbers_are_no_labels(tmp_path, image, values):
    path = write(tmp_path / "mask.nii.gz", (values / 2).astype(np.float32))
    with pytest.raises(InputError, match="its values are not whole numbers, so they are not labels; give a mask with"):
        read_mask(path, image)


def test_a_damaged_table_of_names_leaves_the_numbers(tmp_path, image, values):
    path = write(tmp_path / "mask.nii", values, {5: "<![CDATA[<"})
    assert np.array_equal(read_mask(path, image, 5), values == 5)


@pytest.mark.parametrize("shift_mm", [0.0, 4.0])
def test_a_segmentation_cropped_by_slicer_is_put_in_its_place(tmp_path, image, values, shift_mm):
    import SimpleITK

    path = tmp_path / "cropped.seg.nrrd"
    part = SimpleITK.GetImageFromArray(values[2:10, 1:, 2:])
    part.SetSpacing([10.0, 10.0, 10.0])
    part.SetOrigin([20.0 + shift_mm, 10.0, 20.0])
    part.SetMetaData("Segmentation_ReferenceImageExtentOffset", "2 1 2")
    SimpleITK.WriteImage(part, str(path))
    if shift_mm:
        with pytest.raises(InputError, match="is on another grid than scan"):
            read_mask(path, image, 5)
    else:
        assert np.array_equal(read_mask(path, image, 5), values == 5)


def test_overlapping_segments_are_refused(tmp_path, image, values):
    import SimpleITK

    path = tmp_path / "two.seg.nrrd"
    layers = SimpleITK.GetImageFromArray(np.stack([values, values], axis=-1), isVector=True)
    layers.SetMetaData("Segment0_Name", "liver")
    SimpleITK.WriteImage(layers, str(path))
    with pytest.raises(InputError, match=r"two\.seg\.nrrd: its segments overlap and lie in 2 layers; export those to"):
        read_mask(path, image, "liver")


def test_labels_that_do_not_touch_keep_the_largest_piece_with_a_warning(tmp_path, image, values):
    import SimpleITK

    scan = SimpleITK.GetImageFromArray(image.hu)
    scan.SetSpacing([10.0, 10.0, 10.0])
    SimpleITK.WriteImage(scan, str(tmp_path / "scan.nrrd"))
    mask = write(tmp_path / "mask.nrrd", values, NAMES)
    entry = {"image": tmp_path / "scan.nrrd", "mask": mask, "label": ["liver", "heart", "organ_104"]}
    with pytest.warns(
        UserWarning, match=r"several pieces, of which the largest is kept \(50 mL\) .* dropped \(4 mL\)\.$"
    ):
        kept = segment_entry(entry)[1]
    assert np.array_equal(kept, (values == 5) | (values == 51))
