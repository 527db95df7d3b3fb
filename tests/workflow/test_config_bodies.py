"""Bodies that only scenes use, and the kinds for them."""

from pathlib import Path

import pytest

from palpate.errors import InputError
from palpate.run.settings import complete

COMMON = {"young_pa": 1e4, "poisson": 0.3, "density_kg_m3": 1000, "anchors": {"nodes": [0, 1, 2]}}
BAR = {"kind": "box", "sizes_m": [0.3, 0.1, 0.1], "divisions": [6, 2, 2], "refinements": 0} | COMMON
CLOTH = {"kind": "sheet", "sizes_m": [0.3, 0.3], "divisions": [6, 6], "thickness_m": 0.001} | COMMON
CT = {"kind": "ct", "refinements": 1} | COMMON
SAMPLES = {"magnitudes": [0.7, 1.3], "train": 8, "test": 6}


def check(smoke, body):
    smoke["bodies"]["new"] = body
    return complete(smoke, Path("my.yaml"))["bodies"]["new"]


@pytest.mark.parametrize("body", [BAR, CLOTH, BAR | {"refinements": 1} | SAMPLES], ids=["box", "sheet", "trained box"])
def test_new_kinds_stand_as_given(smoke, body):
    assert check(smoke, body) == body


def test_a_ct_is_the_synthetic_abdomen_by_default(smoke):
    body = check(smoke, CT | SAMPLES)
    assert body["image"] is None
    assert body["mask"] is None
    assert body["threshold_hu"] == [30, 120]
    assert body["surface_nodes"] == 140
    assert body["snap"] is False


def test_an_image_may_be_a_folder_and_a_mask_not(smoke, tmp_path):
    (tmp_path / "slices").mkdir()
    smoke["bodies"]["new"] = CT | {"image": "slices"}
    assert complete(smoke, tmp_path / "my.yaml")["bodies"]["new"]["image"] == "slices"
    smoke["bodies"]["new"] |= {"mask": "slices"}
    with pytest.raises(InputError, match=r"bodies\.new\.mask is slices, where there is no file; give a path relative"):
        complete(smoke, tmp_path / "my.yaml")


def test_a_body_without_samples_needs_no_refinement(smoke):
    liver = {key: value for key, value in smoke["bodies"]["liver"].items() if key not in {*SAMPLES, "paper_surface"}}
    assert check(smoke, liver | {"refinements": 0})["refinements"] == 0


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (BAR | {"train": 8, "test": 6}, "bodies.new lacks magnitudes; give magnitudes, train and test together"),
        (BAR | {"magnitudes": [1.0]}, "bodies.new lacks train; give magnitudes"),
        (BAR | SAMPLES, "bodies.new.refinements is 0; give at least 1"),
        (BAR | {"refinements": 1} | SAMPLES | {"test": 5}, "bodies.new.test is 5; make it a multiple"),
        (
            BAR | {"regions": {"a": {"young_pa": 1e5}}},
            "bodies.new.regions.a needs exactly one of tag, sphere and label",
        ),
        (
            BAR | {"regions": {"a": {"young_pa": 1e5, "tag": 1, "sphere": {"center_m": [0, 0, 0], "radius_m": 1}}}},
            "bodies.new.regions.a needs exactly one of",
        ),
        (CLOTH | SAMPLES, "bodies.new has an unknown key magnitudes"),
        (CLOTH | {"refinements": 1}, "bodies.new has an unknown key refinements"),
        (CLOTH | {"thickness_m": 0.0}, "bodies.new.thickness_m is 0.0, but must be above 0"),
        (BAR | {"sizes_m": [0.3, 0.1]}, "bodies.new.sizes_m is [0.3, 0.1], but must have at least 3 entries"),
        (CT | {"image": "none.nii.gz"}, "bodies.new.image is none.nii.gz, where there is no file; give a path"),
        (CT | {"mask": __file__}, "bodies.new.mask is given and image is not; give the image that the mask"),
        (CT | {"threshold_hu": [120, 30]}, "bodies.new.threshold_hu is [120, 30]; give the lower number first."),
        (CT | {"image": ""}, "bodies.new.image is '', but must not be empty"),
        (CT | {"image": __file__, "mask": ""}, "bodies.new.mask is '', but must not be empty"),
        (CT | {"surface_nodes": 8}, "bodies.new.surface_nodes is 8, but must be at least 12"),
        (CT | {"crop_m": [[0, 0, 0]]}, "bodies.new.crop_m is [[0, 0, 0]], but must have at least 2 entries"),
        (BAR | {"divisions": [6, 0, 2]}, "bodies.new.divisions[1] is 0, but must be at least 1 (Coarse cells along x"),
    ],
)
def test_what_is_wrong_is_said(smoke, body, said):
    with pytest.raises(InputError) as caught:
        check(smoke, body)
    assert str(caught.value).startswith(f"my.yaml: {said}")
