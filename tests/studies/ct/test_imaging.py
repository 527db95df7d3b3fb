"""Steps from a scan to a picture and a mask, against the synthetic abdomen's truth."""

import numpy as np
import pytest

from palpate.bodies.ct.synthetic_abdomen import SHAPES, abdomen
from palpate.report.tables import columns
from palpate.studies.ct import claims, imaging, ray_casting
from palpate.studies.ct.imaging import liver_side, shape_shares
from palpate.studies.ct.settings import Imaging

pytestmark = pytest.mark.slow

VOXEL_M = 0.004


@pytest.fixture(scope="module")
def measured():
    image, truth = abdomen(spacing_m=(VOXEL_M,) * 3)
    return imaging.measure({"abdomen": (image, truth["liver"])}, Imaging(every=[2, 5, 80], pixels=48, voxel_m=VOXEL_M))


def test_tables_have_what_is_declared_and_no_hole(measured):
    for name, table in measured[0].items():
        assert list(table) == columns(name) and len(table) and not table.isna().any(axis=None), name


def test_both_orders_give_one_picture_and_early_rays_take_fewer_samples(measured):
    for _, orders in measured[0]["compositing"].groupby("looks"):
        front = orders[orders["order"] == "front to back"].sort_values("enough", ascending=False)
        assert front["difference"].iloc[0] <= 1e-6
        assert (np.diff(front["samples"]) < 0).all()
        assert (front["difference"] <= 1 - front["enough"] + 1e-6).all()


def test_masks_come_back_better_than_by_the_nearest_slice(measured):
    masks = measured[0]["mask_interpolation"].set_index(["every", "method"])["dice"]
    for n in (2, 5):
        assert masks[n, imaging.BETWEEN] > masks[n, imaging.NEAREST] + 0.01
    assert set(masks.index.unique("every")) == {2, 5}  # of every 80th slice there are too few


def test_normals_of_the_exact_liver_are_those_of_differences():
    points = np.random.default_rng(0).uniform(-0.05, 0.05, (50, 3))
    side, normals = liver_side(points)
    slopes = np.column_stack([(liver_side(points + 1e-6 * e)[0] - side) / 1e-6 for e in np.eye(3)])
    assert normals == pytest.approx(slopes / np.linalg.norm(slopes, axis=1, keepdims=True), abs=1e-4)


def test_a_blur_brings_normals_nearer_to_the_exact_ones(measured):
    normals = measured[0]["surface_normals"].set_index(["blur_voxels", "normals_from"])
    for source in (imaging.GRADIENT, imaging.CORNERS, imaging.TRIANGLES):
        assert normals.loc[(1.0, source), "median_deg"] < normals.loc[(0.0, source), "median_deg"]
    assert normals["rms_m"].max() < VOXEL_M / 2 and normals["points"].min() > 500


def test_a_mixture_finds_the_tissues_that_grey_values_were_drawn_from():
    random = np.random.default_rng(3)
    means, shares = [-990.0, -90.0, 45.0, 380.0], [0.5, 0.3, 0.15, 0.05]
    grey = random.choice(means, 200_000, p=shares) + random.normal(0, 20, 200_000)
    mixture = ray_casting.fit_mixture(grey, [tissue.hu for tissue in ray_casting.TISSUES])
    assert mixture.means == pytest.approx(means, abs=2)
    assert mixture.shares == pytest.approx(shares, abs=0.01) and mixture.deviations == pytest.approx([20] * 4, abs=1.5)
    values = np.linspace(-1100, 800, 400)
    likely = ray_casting.probabilities(mixture, values)
    assert likely.sum(axis=0) == pytest.approx(1) and (np.diff(likely.argmax(axis=0)) >= 0).all()


def test_shares_of_shapes_make_the_scan():
    """Drawn one over the other, their grey values are those of the scan without its noise."""
    image, shares = abdomen(spacing_m=(VOXEL_M,) * 3)[0], shape_shares((VOXEL_M,) * 3)
    grey = sum(shares[name] * hu for name, (hu, *_) in SHAPES.items()) - 1024 * (1 - sum(shares.values()))
    inside = sum(shares.values()) > 0.99
    assert (image.hu - grey)[inside].std() == pytest.approx(12, rel=0.05)
    assert abs((image.hu - grey)[inside].mean()) < 0.5


def test_each_scan_is_segmented(measured):
    scans = measured[0]["segmented_scans"].set_index("scan")["dice"]
    assert scans["CT"] > 0.95 and scans["MRI, evened"] > scans["MRI"]
    assert [image.modality for image, _ in measured[1].mris] == ["mri", "mri"]


def test_claims_follow_the_tables(measured):
    tables = measured[0]
    found = list(claims.imaging(tables))
    assert all(claim.paper == 3 and claim.section.startswith("2") for claim in found) and len(found) == 8
    told = {claim.claim: claim.verdict for claim in found}
    for claim, table, wrong in (
        ("compositing back to front and front to back give one picture", "compositing", {"difference": 0.01}),
        ("an organ that is drawn on every n-th slice can be interpolated between", "mask_interpolation", {"dice": 0.9}),
    ):
        changed = claims.imaging(tables | {table: tables[table].assign(**wrong)})
        assert (told[claim], {row.claim: row.verdict for row in changed}[claim]) == ("confirmed", "refuted")
