"""Bodies from CT and MRI: the whole way, thin and cut organs."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
import SimpleITK
from fixtures.scans import write_scan
from scipy.spatial.transform import Rotation

from palpate.bodies.ct import mesh_from_ct
from palpate.bodies.ct.config_scan import scan_of
from palpate.bodies.ct.image import AIR_HU, Image, read
from palpate.bodies.ct.masses import organ_densities, voxel_mass
from palpate.bodies.ct.mesh_from_ct import THINNEST, cut_off, refuse_thin
from palpate.bodies.ct.segmentation import segment
from palpate.bodies.ct.synthetic_abdomen import abdomen, mri_abdomen
from palpate.bodies.make_body import make_body
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import check_boundary, check_closed
from palpate.bodies.settings import Ct, Plane
from palpate.errors import InputError
from palpate.studies.ct.imaging import dice

ABDOMEN = Ct(young_pa=3000, poisson=0.3, refinements=1, anchors=Plane(axis="y", side="max", depth_m=0.03))


def check_whole(mesh: TetMesh):
    """Watertight, a manifold, of one piece without handles."""
    check_boundary("body", mesh)
    check_closed("body", mesh.nodes, mesh.triangles)
    assert len(mesh.triangles) == 2 * len(mesh.surface) - 4


def mesh_of(entry) -> TetMesh:
    return mesh_from_ct.build(entry)[0]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The synthetic abdomen as an image and a mask on disk, with its truth."""
    folder = tmp_path_factory.mktemp("ct")
    image, truth = abdomen(spacing_m=(0.004, 0.004, 0.004))
    mask = write_scan(folder / "mask.nii.gz", truth["liver"].astype(np.uint8), image)
    return {"image": write_scan(folder / "scan.nii.gz", image.hu, image), "mask": mask}, truth


def test_a_crop_keeps_places_and_warns_where_it_cuts(files):
    paths, truth = files
    around = {"crop_m": [[-0.14, -0.09, -0.05], [0.05, 0.06, 0.09]]}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        image, mask = mesh_from_ct.segment_entry(ABDOMEN.but(**paths, **around))
    whole, liver = mesh_from_ct.segment_entry(ABDOMEN.but(**paths))
    assert image.hu.size < whole.hu.size / 4
    middle, same = (i.to_world(np.argwhere(m)).mean(axis=0) for i, m in ((image, mask), (whole, liver)))
    assert np.allclose(middle, same, atol=1e-6)
    half = {"crop_m": [[-0.14, -0.09, 0.02], [0.05, 0.06, 0.09]]}
    sentence = r"scan\.nii\.gz: the organ is cut off by crop_m towards the feet \(1\d\d cm²\); the body ends there"
    with pytest.warns(UserWarning, match=sentence):
        mesh = mesh_of(ABDOMEN.but(**paths, **half))
    check_whole(mesh)
    assert mesh.volumes.sum() == pytest.approx(truth["volume_m3"] / 2, rel=0.05)


def test_a_body_from_an_oblique_scan_and_its_regions_and_crop_are_in_the_scanners_frame(files, tmp_path):
    """Coordinates along the axes of a scan that is turned by 4° would be 28 mm off at the height of an abdomen."""
    turn, far = Rotation.from_euler("xyz", [3, -2, 2], degrees=True).as_matrix(), np.array([0.0, 0.0, 0.4])
    turned = {}
    for key, path in files[0].items():
        scan = SimpleITK.ReadImage(path)
        scan.SetOrigin((turn @ (1e3 * far + scan.GetOrigin())).tolist())
        scan.SetDirection((turn @ np.reshape(scan.GetDirection(), (3, 3))).ravel().tolist())
        SimpleITK.WriteImage(scan, turned.setdefault(key, str(tmp_path / f"{key}.nii.gz")))
    ball = np.array([-0.1, -0.015, 0.03])
    bodies = []
    for paths, place in ((files[0], ball), (turned, turn @ (far + ball))):
        ways = {"lump": {"sphere": {"center_m": place.tolist(), "radius_m": 0.03}, "young_pa": 9000}}
        anchors = {"sphere": {"center_m": place.tolist(), "radius_m": 0.04}}
        bodies.append(make_body("liver", ABDOMEN.but(**paths, refinements=0, anchors=anchors, regions=ways)))
    upright, oblique = bodies
    assert oblique.coarse.volumes.sum() == pytest.approx(upright.coarse.volumes.sum(), rel=1e-6)
    meshes = upright.coarse, oblique.coarse
    middles = [np.average(mesh.nodes[mesh.tetrahedra].mean(axis=1), axis=0, weights=mesh.volumes) for mesh in meshes]
    assert np.allclose(middles[1], turn @ (far + middles[0]), atol=3e-4)
    assert np.allclose([d.mean() for d in oblique.densities], [d.mean() for d in upright.densities], rtol=5e-3)
    around = turn @ (far + middles[0]) + np.array([[-0.12, -0.1, -0.1], [0.12, 0.1, 0.1]])
    crop = {"crop_m": around.tolist()}
    whole, cropped = (mesh_from_ct.segment_entry(ABDOMEN.but(**turned, **more))[1] for more in ({}, crop))
    assert whole.sum() == cropped.sum() and whole.size > 1.5 * cropped.size


def test_pieces_of_a_mask_that_are_left_out_are_reported(files, tmp_path):
    paths, truth = files
    image = read(paths["image"])
    two = truth["liver"].astype(np.uint8)
    two[5:10, 5:10, 5:10] = 1
    mask = write_scan(tmp_path / "two.nii.gz", two, image)
    with pytest.warns(UserWarning, match=r"two\.nii\.gz: the mask is in several pieces, .* are dropped \(8 mL\)\.$"):
        kept = mesh_from_ct.segment_entry(ABDOMEN.but(**paths | {"mask": mask}))[1]
    assert np.array_equal(kept, truth["liver"])


@pytest.mark.parametrize(
    ("crop_m", "message"),
    [
        ([[1, 1, 1], [2, 2, 2]], r"crop_m has no voxel inside; the image reaches from \(-0\.16.* m\.$"),
        ([[0.1, 0.05, -0.1], [0.15, 0.1, 0]], "crop_m leaves nothing of the mask; give a box"),
    ],
)
def test_crops_that_leave_nothing_are_reported(files, crop_m, message):
    with pytest.raises(InputError, match=message):
        mesh_from_ct.segment_entry(ABDOMEN.but(**files[0], crop_m=crop_m))


@pytest.mark.parametrize(("axis", "name"), [(0, "z"), (1, "y"), (2, "x")])
def test_an_organ_of_three_slices_is_refused_and_one_of_four_is_not(axis, name):
    image = abdomen(spacing_m=(0.02, 0.02, 0.02))[0]
    mask = np.zeros(image.hu.shape, dtype=bool)
    mask[2:12, 2:12, 2:12] = True
    np.moveaxis(mask, axis, 0)[2 + THINNEST :] = False
    refuse_thin(image, mask)
    np.moveaxis(mask, axis, 0)[1 + THINNEST] = False
    with pytest.raises(InputError, match=f"the organ is 3 voxels thick along {name}, and 4 are"):
        refuse_thin(image, mask)


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
        (np.s_[0:8, 5:15, 5:25], ["feet (4 cm²)"]),  # 10 × 2 mm by 20 × 1 mm
        (np.s_[2:, 5:15, 5:25], ["head (4 cm²)"]),
        (np.s_[2:8, :15, 5:25], ["front (6 cm²)"]),  # 6 × 5 mm by 20 × 1 mm
        (np.s_[2:8, 5:, 5:25], ["back (6 cm²)"]),
        (np.s_[2:8, 5:15, :25], ["right (6 cm²)"]),  # 6 × 5 mm by 10 × 2 mm
        (np.s_[2:8, 5:15, 5:], ["left (6 cm²)"]),
        (np.s_[:, 5:15, 5:25], ["feet (4 cm²)", "head (4 cm²)"]),
    ],
)
def test_each_side_is_named_with_its_area_and_a_crop_is_told_from_the_image(image, box, where):
    assert said(image, box) == [f"the image towards the {side}" for side in where]
    cropped = said(image, np.s_[:, 5:15, 5:25], (15, 20, 30), (5, 0, 0))
    assert [cut.partition(" towards")[0] for cut in cropped] == ["crop_m", "the image"]


def test_padding_beside_an_organ_cuts_it_and_the_air_of_a_lung_does_not(image):
    box = np.s_[2:8, 5:15, 5:25]
    image.hu[:, :, 25:] = AIR_HU
    assert said(image, box) == ["the padding around the scanned circle (6 cm²)"]
    assert said(replace(image, modality="mri"), box) == []
    image.hu[:, :, 25:] = AIR_HU + 60
    assert said(image, box) == []


RANGE = (400, 600)
COARSE_M = (0.004, 0.004, 0.004)


@pytest.fixture(scope="module")
def files_mri(tmp_path_factory):
    """The synthetic MRI and a mask of its liver, drawn on each third slice, on disk; and its truth."""
    folder = tmp_path_factory.mktemp("mri")
    image, truth = mri_abdomen(spacing_m=COARSE_M)
    drawn = np.zeros(image.hu.shape, dtype=np.uint8)
    drawn[1::3] = truth["liver"][1::3]
    return {
        "modality": "mri",
        "image": write_scan(folder / "scan.nii.gz", image.hu, image),
        "mask": write_scan(folder / "drawn.nii.gz", drawn, image),
    }, truth


def test_its_grey_values_are_kept_and_need_not_be_negative(files_mri):
    image = read(files_mri[0]["image"], "mri")
    assert image.modality == "mri" and np.array_equal(image.hu, mri_abdomen(spacing_m=COARSE_M)[0].hu)
    assert image.hu.min() >= 0
    with pytest.raises(InputError, match=r"not a CT in Hounsfield units; .* or say modality: mri\.$"):
        read(files_mri[0]["image"])


@pytest.mark.slow
def test_uneven_brightness_hides_the_liver_until_it_is_evened_out():
    raw, truth = mri_abdomen()
    even = scan_of(ABDOMEN.but(modality="mri", even_brightness=True))
    level = float(np.median(even.hu[truth["liver"]]) / 500)
    found, better = segment(raw, RANGE), segment(even, [400 * level, 600 * level])
    assert dice(better, truth["liver"]) > 0.97
    assert dice(found, truth["liver"]) < dice(better, truth["liver"]) - 0.03
    inside = [np.std(image.hu[truth["liver"]]) / np.mean(image.hu[truth["liver"]]) for image in (raw, even)]
    assert inside[1] < 0.6 * inside[0]


def test_a_body_from_an_mri_and_a_mask_drawn_on_each_third_slice(files_mri):
    paths, truth = files_mri
    body = make_body("liver", ABDOMEN.but(**paths, drawn_slices="z", refinements=0))
    assert body.coarse.volumes.sum() == pytest.approx(truth["volume_m3"], rel=0.02)


def test_a_mask_drawn_on_some_slices_is_not_taken_for_a_whole_one(files_mri):
    sentence = r"drawn\.nii\.gz: the mask is drawn on some slices only, .* give drawn_slices: z to have them filled"
    with pytest.raises(InputError, match=sentence):
        mesh_from_ct.segment_entry(ABDOMEN.but(**files_mri[0]))


def test_what_needs_a_unit_is_refused(files_mri):
    image = read(files_mri[0]["image"], "mri")
    liver = files_mri[1]["liver"]
    with pytest.raises(InputError, match=r"grey values of an MRI have no unit, .* give threshold, the lowest"):
        mesh_from_ct.segment_entry(ABDOMEN.but(modality="mri", image=files_mri[0]["image"]))
    for weighed in (voxel_mass, lambda *scan: organ_densities(np.zeros((1, 3)), *scan)):
        with pytest.raises(InputError, match="an MRI does not show how dense tissue is; give density_kg_m3, or a CT"):
            weighed(image, liver)
    with pytest.raises(InputError, match="even_brightness is for an MRI, as CT numbers are absolute"):
        scan_of(ABDOMEN.but(even_brightness=True))
