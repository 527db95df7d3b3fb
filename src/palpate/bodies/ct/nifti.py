"""What ITK's reader of NIfTI files does not say: that one is cut off, or has voxels that are no numbers."""

import gzip
import zlib
from pathlib import Path

import numpy as np

from palpate.errors import InputError

_GZIP = b"\x1f\x8b"
# by the size of a header that its first four bytes tell: where the eight dimensions, the type of the voxels, the bits
# of each and the place of the first one stand, and as what
_FIELDS = {
    348: ((40, "i2"), (70, "i2"), (72, "i2"), (108, "f4")),  # NIfTI-1
    540: ((16, "i8"), (12, "i2"), (14, "i2"), (168, "i8")),  # NIfTI-2
}
_FLOATS = {16: "f4", 64: "f8"}


def check(path: Path) -> None:
    """InputError if a .nii or .nii.gz file ends too early, is damaged, or holds NaN or infinity.

    Trap: ITK takes what is missing for 0 HU, and what is no finite number as well: both are water, and no error.
    A file that is no NIfTI at all is left to the reader to refuse.
    """
    damaged = f"{path}: the file is cut off or damaged; write or download it again."
    try:
        data = path.read_bytes()
        data = gzip.decompress(data) if data.startswith(_GZIP) else data  # which checks length and CRC
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(damaged) from error
    order = next((o for o in "<>" if len(data) >= 4 and int(np.frombuffer(data, f"{o}i4", 1)[0]) in _FIELDS), None)
    if order is None:
        return
    header = int(np.frombuffer(data, f"{order}i4", 1)[0])
    if len(data) < header:
        raise InputError(damaged)
    (dims, kind), *places = _FIELDS[header]
    counts = np.frombuffer(data, f"{order}{kind}", 8, dims)
    stored, bits, first = (int(np.frombuffer(data, f"{order}{k}", 1, at)[0]) for at, k in places)
    voxels = int(np.prod(np.maximum(counts[1 : 1 + max(int(counts[0]), 0)], 1), dtype=np.int64))
    if len(data) < first + voxels * bits // 8:
        raise InputError(damaged)
    if stored in _FLOATS and not np.isfinite(np.frombuffer(data, order + _FLOATS[stored], voxels, first)).all():
        raise InputError(
            f"{path}: it has voxels that are not finite numbers; fill them with air, -1024 HU, or in a mask with 0."
        )
