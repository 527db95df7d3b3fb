"""Checks that ITK's reader of NIfTI files lacks: truncated files, and voxels that are not numbers."""

import gzip
import zlib
from pathlib import Path

import numpy as np

from palpate.errors import InputError

_GZIP = b"\x1f\x8b"
# by the size of the header, which its first four bytes give: offset and type of the eight dimensions, of the voxels'
# type, of the bits of each voxel and of the position of the first one
_HEADERS = {
    348: ((40, "i2"), (70, "i2"), (72, "i2"), (108, "f4")),  # NIfTI-1
    540: ((16, "i8"), (12, "i2"), (14, "i2"), (168, "i8")),  # NIfTI-2
}
_FLOATS = {16: "f4", 64: "f8"}


def check(path: Path) -> None:
    """Raise InputError if a .nii or .nii.gz file is truncated, damaged, or holds NaN or infinity.

    Trap: ITK reads missing voxels as 0 HU, and non-finite ones as well: both become water, without an error.
    A file that is not NIfTI at all is left to the reader to refuse.
    """
    damaged = f"{path}: the file is cut off or damaged; write or download it again."
    try:
        data = path.read_bytes()
        data = gzip.decompress(data) if data.startswith(_GZIP) else data  # which checks length and CRC
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(damaged) from error
    order = next((o for o in "<>" if len(data) >= 4 and int(np.frombuffer(data, f"{o}i4", 1)[0]) in _HEADERS), None)
    if order is None:
        return
    header = int(np.frombuffer(data, f"{order}i4", 1)[0])
    if len(data) < header:
        raise InputError(damaged)
    (dims, kind), *places = _HEADERS[header]
    counts = np.frombuffer(data, f"{order}{kind}", 8, dims)
    voxel_type, bits, first = (int(np.frombuffer(data, f"{order}{k}", 1, at)[0]) for at, k in places)
    voxels = int(np.prod(np.maximum(counts[1 : 1 + max(int(counts[0]), 0)], 1), dtype=np.int64))
    if len(data) < first + voxels * bits // 8:
        raise InputError(damaged)
    if voxel_type in _FLOATS and not np.isfinite(np.frombuffer(data, order + _FLOATS[voxel_type], voxels, first)).all():
        raise InputError(
            f"{path}: it has voxels that are not finite numbers; fill them with air, -1024 HU, or in a mask or an MRI "
            "with 0."
        )
