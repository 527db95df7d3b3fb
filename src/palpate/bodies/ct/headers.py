"""What headers of scans say: whether a file is whole, its unit, and where its axes point, which are at right angles."""

import gzip
import math
import re
import zlib
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate.errors import InputError

# how far, in voxels, corners of two grids may lie apart: by rounding; of an image and its mask, as a quaternion in
# single precision moves those of 512 voxels by 0.2; and by a shear, from those of a grid at right angles
ROUNDED, SAME_GRID, SHEARED = 1e-2, 0.3, 0.1
_FLOATS = (16, 64)  # NIfTI's codes of voxels that are real numbers
NIFTI = (".nii", ".nii.gz")
_DAMAGED = "{}: the file is cut off or damaged; write or download it again."
# what ITK knows of where the axes of NRRD and MetaImage files point, and units that it does not read
_FRAMES = {
    "space": r"^space: *(LPS|[LR]AS|left-posterior-superior|(left|right)-anterior-superior)\s",
    "TransformMatrix": "^(TransformMatrix|Orientation|Rotation) *=",
}
_OTHER_UNIT = r"(?:units:|DistanceUnits *=)[ \"]*(?!mm|millimet|none)(\w+)"


def check_header(path: Path) -> str:
    """Check an image file's header; return the name of its entry that says where the axes point, "" if none does.

    Raises InputError if a NIfTI file is not whole, or its axes are sheared or given twice, or for a unit in text.
    Traps: ITK takes the qform where the sform is sheared, and does not read units in text.
    """
    if not path.name.lower().endswith(NIFTI):
        with path.open("rb") as file:
            text = file.read(1 << 14).decode("latin-1")
        if unit := re.search(_OTHER_UNIT, text, re.IGNORECASE):
            raise InputError(f"{path}: its header counts in {unit[1]}, and mm are read; write it in mm.")
        return next((name for name, line in _FRAMES.items() if re.search(line, text, re.IGNORECASE | re.MULTILINE)), "")
    reader = _nifti(path)
    header = reader.GetNIFTIHeader()
    _check_voxels(path, header)
    spacing, counts = ([get(axis) for axis in (1, 2, 3)] for get in (header.GetPixDim, header.GetDim))
    matrices = {"sform": reader.GetSFormMatrix(), "qform": reader.GetQFormMatrix()}
    forms = {
        name: np.reshape(form.GetData(), (4, 4))[:3] * [*spacing, 1.0]
        for name, form in matrices.items()
        if form and form.Determinant()
    }
    for form in forms.values():
        orthonormal(path, form[:, :3] / spacing, np.array(spacing), counts)
    if len(forms) > 1 and (off := apart(forms["sform"], forms["qform"], counts)) > SAME_GRID:
        raise InputError(
            f"{path}: its sform and its qform disagree, by up to {off:.3g} voxels; set the code of the wrong one to 0."
        )
    return next(iter(forms), "")


def _check_voxels(path: Path, header: Any) -> None:
    """Raise InputError for a NIfTI file that is truncated, damaged, or holds NaN or infinity.

    Trap: ITK reads missing voxels as 0 HU, and non-finite ones as well: both become water, without an error.
    """
    count = math.prod(max(header.GetDim(axis), 1) for axis in range(1, 1 + header.GetDim(0)))
    first_byte, bits = header.GetVoxOffset(), header.GetBitPix()
    try:
        with _opened(path) as file:
            data = file.read()  # of a packed one this checks length and CRC
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(_DAMAGED.format(path)) from error
    if len(data) < first_byte + count * bits // 8:
        raise InputError(_DAMAGED.format(path))
    if header.GetDataType() in _FLOATS:
        order = "<" if int.from_bytes(data[:4], "little") < 1000 else ">"  # it begins with its length, 348 or 540
        if not np.isfinite(np.frombuffer(data, f"{order}f{bits // 8}", count, first_byte)).all():
            raise InputError(
                f"{path}: it has voxels that are not finite numbers; fill them with air, -1024 HU, or in a mask or an "
                "MRI with 0."
            )


def _nifti(path: Path) -> Any:
    """Read the header of a NIfTI file with VTK; InputError if it has none."""
    from vtkmodules.vtkIOImage import vtkNIFTIImageReader

    reader = vtkNIFTIImageReader()
    if not reader.CanReadFile(str(path)):
        raise InputError(_DAMAGED.format(path))
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    return reader


def _opened(path: Path) -> gzip.GzipFile | BufferedReader:
    """Open a NIfTI file, whose name need not say whether it is packed."""
    with path.open("rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
    return gzip.open(path) if packed else path.open("rb")


def extensions(path: Path) -> bytes:
    """Return the bytes before a NIfTI file's first voxel: header and extensions."""
    with _opened(path) as file:
        return file.read(_nifti(path).GetNIFTIHeader().GetVoxOffset())


def apart(first: np.ndarray, second: np.ndarray, counts: ArrayLike) -> float:
    """Return how far a grid's corners lie apart at most [voxels], by two matrices (3, 4) from indices to places."""
    corners = np.array(list(np.ndindex(2, 2, 2))) * (np.array(counts) - 1)
    displacements = (second - first) @ np.column_stack([corners, np.ones(8)]).T
    return float(np.abs(np.linalg.solve(first[:, :3], displacements)).max())


def angle_deg(first: np.ndarray, second: np.ndarray) -> float:
    """Return the angle [°] of the rotation between two frames, (3, 3) columns."""
    return math.degrees(2.0 * math.asin(min(float(np.linalg.norm(second - first)) / math.sqrt(8.0), 1.0)))


def orthonormal(source: Path, axes: np.ndarray, steps: np.ndarray, counts: ArrayLike) -> np.ndarray:
    """Return the axes, (3, 3) columns, as a rotation or a reflection; InputError if they are not at right angles.

    steps, counts : (3,) between voxels [mm], and of voxels along each of them
    """
    left_vectors, _, right_vectors = np.linalg.svd(axes)
    rotation = left_vectors @ right_vectors
    if (np.abs((axes - rotation) * steps) @ np.array(counts)).max() / 2 <= SHEARED * steps.min():
        return axes if np.abs(axes - rotation).max() < 1e-6 else rotation
    units = axes / np.linalg.norm(axes, axis=0)
    angle = np.degrees(np.arcsin(np.abs(np.triu(units.T @ units, 1)).max()))
    fault = f"sheared by {angle:.3g}°, as by a tilted gantry" if angle > 1e-3 else "not as long as its spacing says"
    raise InputError(f"{source}: its axes are {fault}; resample it to an upright grid, or mend its header.")
