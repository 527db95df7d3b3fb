"""Headers of scans: one organ however its file stores it, or a refusal that says why."""

import struct
from itertools import permutations, product

import numpy as np
import pytest
import SimpleITK
from fixtures.scans import write_series
from scipy.spatial.transform import Rotation

from palpate.bodies.ct.image import read, read_mask
from palpate.errors import InputError

SPACING, COUNTS, ORIGIN = np.array([2.0, 3.0, 4.0]), (30, 24, 18), np.array([-70.0, 20.0, 310.0])
LEFT_BACK_HEAD = (20, 17, 12)
FORMATS = (".nii", ".nrrd", ".mha")
TURNS = [Rotation.from_euler("xyz", angles, degrees=True) for angles in [(0.3, 0, 0), (2, -3, 4), (10, 25, -15)]]
WAYS = list(product(permutations(range(3)), product((1, -1), repeat=3)))


def organ() -> np.ndarray:
    """Return an ellipsoid of 60 HU in fat, along x, y and z, with one bright voxel to its left, back and head."""
    index = np.stack(np.indices(COUNTS), axis=-1)
    hu = np.where((((index - (14, 12, 9)) / (9, 7, 5)) ** 2).sum(axis=-1) < 1, 60, -100).astype(np.int16)
    hu[LEFT_BACK_HEAD] = 300
    return hu


UPRIGHT = np.eye(3)


def stored(order=(0, 1, 2), signs=(1, 1, 1), turn=UPRIGHT, values=None):
    """Return the organ with its axes in another order and direction, turned as a whole in the scanner's frame."""
    values = np.transpose(organ() if values is None else values, order)
    values = np.flip(values, [axis for axis in range(3) if signs[axis] < 0])
    direction, first = np.zeros((3, 3)), np.zeros(3)
    for axis, (along, sign) in enumerate(zip(order, signs, strict=True)):
        direction[along, axis] = sign
        first[along] = 0 if sign > 0 else COUNTS[along] - 1
    image = SimpleITK.GetImageFromArray(np.ascontiguousarray(values.transpose()))
    image.SetSpacing(SPACING[list(order)].tolist())
    image.SetDirection((turn @ direction).ravel().tolist())
    image.SetOrigin((turn @ (ORIGIN + SPACING * first)).tolist())
    return image


def written(folder, suffix, image, **tags):
    """Write an image as a file, or as DICOM slices in a folder; return the path."""
    path = folder / f"scan{suffix}"
    if suffix == ".dcm":
        return write_series(path, image, **tags)
    SimpleITK.WriteImage(image, str(path))
    return path


def check_same(path, turn=UPRIGHT):
    """Check that an image shows the organ with its volume where it is, and the bright voxel on its side."""
    image = read(path)
    assert (image.hu > 0).sum() * image.voxel_m3 == pytest.approx((organ() > 0).sum() * 24e-9, rel=1e-6)
    assert np.allclose(image.axes @ image.axes.T, np.eye(3), atol=1e-6) and np.linalg.det(image.axes) > 0
    for index, there in (
        (np.argwhere(image.hu > 0).mean(axis=0), np.argwhere(organ() > 0).mean(axis=0)),
        (np.unravel_index(np.argmax(image.hu), image.hu.shape), LEFT_BACK_HEAD),
    ):
        assert np.allclose(image.to_world(np.array(index)), turn @ (ORIGIN + SPACING * there) / 1e3, atol=1e-6)
        assert np.allclose(image.to_index(image.to_world(np.array(index))), index, atol=1e-6)


@pytest.mark.parametrize("suffix", [*FORMATS, ".dcm"])
def test_every_order_and_direction_of_axes_is_the_same_organ(tmp_path, suffix):
    for number, way in enumerate(WAYS[:: 6 if suffix == ".dcm" else 1]):
        (tmp_path / str(number)).mkdir()
        check_same(written(tmp_path / str(number), suffix, stored(*way)))


@pytest.mark.parametrize("suffix", [*FORMATS, ".dcm"])
@pytest.mark.parametrize(("turn", "way"), list(zip(TURNS, WAYS[5::17], strict=True)), ids=["0.5°", "5°", "30°"])
def test_an_oblique_organ_is_where_the_scanner_saw_it(tmp_path, suffix, turn, way):
    check_same(written(tmp_path, suffix, stored(*way, turn.as_matrix())), turn.as_matrix())


def sheared(folder, suffix, degrees):
    """Write the organ with its third axis leaning towards the second."""
    lean = np.eye(3)
    lean[:, 2] = 0, np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    if suffix not in (".sform", ".both"):
        return written(folder, suffix, stored(turn=lean))
    path = written(folder, ".nii", stored())
    rows = np.column_stack([np.diag([-1, -1, 1]) @ lean * SPACING, np.diag([-1, -1, 1]) @ ORIGIN])
    return patched(path, {280: ("12f", rows.ravel())} | ({252: ("h", [0])} if suffix == ".sform" else {}))


def patched(path, fields):
    """Write values of struct's kinds into a NIfTI header, by their places; return the path."""
    data = bytearray(path.read_bytes())
    for place, (kind, values) in fields.items():
        struct.pack_into(f"<{kind}", data, place, *values)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("suffix", [".sform", ".both", ".nrrd", ".mha", ".dcm"])
def test_axes_that_are_not_at_right_angles_are_refused_with_their_angle(tmp_path, suffix, degrees=-1.5):
    with pytest.raises(InputError, match=rf"scan\S*: its axes are sheared by {abs(degrees)}°, as by a tilted gantry;"):
        read(sheared(tmp_path, suffix, degrees))


def test_axes_that_are_not_of_length_1_are_refused_and_itks_reason_is_passed_on(tmp_path):
    text = written(tmp_path, ".mha", stored()).read_bytes()
    for matrix, said in (
        ("1 0 0 0 1 0 0 0 2", "not as long as its spacing says;"),
        ("0 " * 9, r"\(.*determinant is 0.*\); wr"),
    ):
        (tmp_path / "other.mha").write_bytes(text.replace(b"1 0 0 0 1 0 0 0 1", matrix.encode()))
        with pytest.raises(InputError, match=rf"other\.mha: .*{said}"):
            read(tmp_path / "other.mha")


@pytest.mark.parametrize(("place", "value"), [(264, np.sin(np.radians(1.5))), (268, 5.0)], ids=["turned", "moved"])
def test_an_sform_and_a_qform_that_disagree_are_refused(tmp_path, place, value):
    path = written(tmp_path, ".nii", stored(signs=(-1, -1, 1)))
    before = struct.unpack_from("<f", path.read_bytes(), place)[0]
    with pytest.raises(InputError, match=r"its sform and its qform disagree, by up to \d\.\d* voxels; set the code of"):
        read(patched(path, {place: ("f", [before + value])}))
    for code in (252, 254):
        read(patched(path, {252: ("2h", [1, 1]), code: ("h", [0])}))


@pytest.mark.parametrize(("code", "metres"), [(1, 1.0), (2, 1e-3), (3, 1e-6)])
def test_units_of_nifti_are_read(tmp_path, code, metres):
    image = stored()
    image.SetSpacing((1e-3 / metres * SPACING).tolist())
    image.SetOrigin((1e-3 / metres * ORIGIN).tolist())
    check_same(patched(written(tmp_path, ".nii", image), {123: ("B", [code])}))


@pytest.mark.parametrize(
    ("suffix", "mark", "field", "unit"),
    [
        (".nrrd", b"kinds", b'space units: "m" "m" "m"\n', "m"),
        (".mha", b"Offset", b"DistanceUnits = cm\n", "cm"),
    ],
)
def test_units_in_text_that_itk_does_not_read_are_refused(tmp_path, suffix, mark, field, unit):
    path = written(tmp_path, suffix, stored())
    path.write_bytes(path.read_bytes().replace(mark, field + mark, 1))
    with pytest.raises(
        InputError, match=rf"scan{suffix}: its header counts in {unit}, and mm are read; write it in mm"
    ):
        read(path)
    path.write_bytes(path.read_bytes().replace(field, field.replace(unit.encode(), b"mm"), 1))
    check_same(path)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_header_that_does_not_say_where_its_axes_point_is_warned_of(tmp_path, suffix):
    path = written(tmp_path, suffix, stored())
    if suffix == ".nii":
        patched(path, {252: ("2h", [0, 0])})
    data = path.read_bytes().replace(b"space: left-posterior-superior", b"space: 3D-right-handed")
    path.write_bytes(data.replace(b"TransformMatrix = 1 0 0 0 1 0 0 0 1\n", b""))
    with pytest.warns(
        UserWarning, match="its header does not say where its axes point; they are taken to point to the"
    ):
        read(path)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_mask_whose_rounded_axes_differ_by_less_than_half_a_voxel_is_taken(tmp_path, suffix):
    turn = Rotation.from_euler("z", 12, degrees=True)
    image = read(written(tmp_path, ".nii", stored(turn=turn.as_matrix())))
    marked = (organ() > 0).astype(np.uint8)
    for degrees, taken in ((0.0, True), (0.2, True), (1.0, False)):
        more = (Rotation.from_euler("z", degrees, degrees=True) * turn).as_matrix()
        mask = stored(values=marked, turn=more)
        mask.SetOrigin((turn.as_matrix() @ ORIGIN).tolist())
        path = written(tmp_path, suffix, mask)
        if not taken:
            with pytest.raises(InputError, match=rf"on another grid than .*: turned by {degrees:g}°; resample it to"):
                read_mask(path, image)
        elif degrees:
            with pytest.warns(
                UserWarning, match=rf"turned by {degrees}°; these are 0\.\d voxels, and the image's grid"
            ):
                assert np.array_equal(read_mask(path, image), image.hu > 0)
        else:
            assert np.array_equal(read_mask(path, image), image.hu > 0)
