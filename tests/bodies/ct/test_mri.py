"""An MRI: grey values without a unit, which segment an organ and say nothing of its density."""

import numpy as np
import pytest
from fixtures.scans import write_scan

from palpate.bodies.ct import mesh_from_ct
from palpate.bodies.ct.image import read
from palpate.bodies.ct.masses import organ_densities, voxel_mass
from palpate.bodies.ct.scan_of import scan_of
from palpate.bodies.ct.segmentation import segment
from palpate.bodies.ct.synthetic_abdomen import mri_abdomen
from palpate.bodies.make_body import make_body
from palpate.errors import InputError

RANGE = {"threshold": [400, 600]}
COARSE_M = (0.004, 0.004, 0.004)


def dice(first, second):
    return 2 * (first & second).sum() / (first.sum() + second.sum())


@pytest.fixture(scope="module")
def files(tmp_path_factory):
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


def test_its_grey_values_are_kept_and_need_not_be_negative(files):
    image = read(files[0]["image"], "mri")
    assert image.modality == "mri" and np.array_equal(image.hu, mri_abdomen(spacing_m=COARSE_M)[0].hu)
    assert image.hu.min() >= 0
    with pytest.raises(InputError, match=r"not a CT in Hounsfield units; .* or say modality: mri\.$"):
        read(files[0]["image"])


def test_uneven_brightness_hides_the_liver_until_it_is_evened_out():
    raw, truth = mri_abdomen()
    even = scan_of({"modality": "mri", "image": None, "even_brightness": True})
    level = float(np.median(even.hu[truth["liver"]]) / 500)
    found, better = segment(raw, RANGE), segment(even, {"threshold": [400 * level, 600 * level]})
    assert dice(better, truth["liver"]) > 0.97
    assert dice(found, truth["liver"]) < dice(better, truth["liver"]) - 0.03
    inside = [np.std(image.hu[truth["liver"]]) / np.mean(image.hu[truth["liver"]]) for image in (raw, even)]
    assert inside[1] < 0.6 * inside[0]


def test_a_body_from_an_mri_and_a_mask_drawn_on_each_third_slice(files, entry):
    paths, truth = files
    held = {"anchors": {"plane": {"axis": "y", "side": "max", "depth_m": 0.03}}}
    more = {"kind": "ct", "drawn_slices": "z", "surface_nodes": 140, "snap": False}
    body = make_body("liver", entry | held | more | paths)
    assert body.coarse.volumes.sum() == pytest.approx(truth["volume_m3"], rel=0.02)


def test_a_mask_drawn_on_some_slices_is_not_taken_for_a_whole_one(files):
    sentence = r"drawn\.nii\.gz: the mask is drawn on some slices only, .* give drawn_slices: z to have them filled"
    with pytest.raises(InputError, match=sentence):
        mesh_from_ct.segment_entry(files[0])


def test_what_needs_a_unit_is_refused(files):
    image = read(files[0]["image"], "mri")
    liver = files[1]["liver"]
    with pytest.raises(InputError, match=r"grey values of an MRI have no unit, .* give threshold, the lowest"):
        mesh_from_ct.segment_entry({"modality": "mri", "image": files[0]["image"], "threshold_hu": [30, 120]})
    for weighed in (voxel_mass, lambda *scan: organ_densities(np.zeros((1, 3)), *scan)):
        with pytest.raises(InputError, match="an MRI does not show how dense tissue is; give density_kg_m3, or a CT"):
            weighed(image, liver)
    with pytest.raises(InputError, match="even_brightness is for an MRI, as CT numbers are absolute"):
        scan_of({"even_brightness": True})
