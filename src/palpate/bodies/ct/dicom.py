"""Reader of one CT or MRI series in a folder of DICOM slices, ordered by their positions."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.bodies.ct.headers import ROUNDED
from palpate.errors import InputError

if TYPE_CHECKING:
    import SimpleITK

# tolerance of positions, relative to the slice distance: headers are rounded to about 1e-3 mm
UNEVEN = 0.02
_TAGS = {"ct": "CT", "mri": "MR"}
_DAMAGED = "{}: it cannot be read as a DICOM image, and seems to be damaged; download or export it again."


@dataclass(frozen=True)
class Slice:
    """Header of one file: position (3,) [mm], row and column direction (6,), the grid, and how the patient lies."""

    file: Path
    series: str
    modality: str
    position: np.ndarray
    orientation: np.ndarray
    grid: tuple
    lies: str


def read_folder(folder: Path, modality: str = "ct") -> "SimpleITK.Image":
    """Read the DICOM series in ``folder`` as a SimpleITK image with rescaled values.

    Raises InputError unless it is one complete series of the ``modality``, "ct" or "mri".

    Traps: file names and instance numbers need not follow the patient, and the tags of slice thickness and of
    spacing between slices need not be the distance between slices; positions define both. The reader applies the
    rescale slope and intercept of each slice, and decodes JPEG 2000.
    """
    import SimpleITK

    slices = [header for file in sorted(folder.iterdir()) if file.is_file() and (header := _read_header(file))]
    _check_series(folder, slices, modality)
    any_slice = slices[0]
    normal = np.cross(any_slice.orientation[:3], any_slice.orientation[3:])
    slices = sorted(slices, key=lambda s: float(s.position @ normal))
    step = _slice_distance(folder, slices, normal)
    image = SimpleITK.GetImageFromArray(np.stack([_rescaled_values(s.file) for s in slices]))
    column, row = any_slice.grid[1:]
    first_to_last = slices[-1].position - slices[0].position
    tilted = np.abs(first_to_last - first_to_last @ normal * normal).max() > ROUNDED * min(column, row)
    upward = first_to_last / np.linalg.norm(first_to_last) if tilted else normal
    image.SetSpacing((row, column, step))
    image.SetOrigin(slices[0].position.tolist())
    image.SetDirection(np.column_stack([any_slice.orientation[:3], any_slice.orientation[3:], upward]).ravel().tolist())
    image.SetMetaData("frame", "positions of its slices")
    image.SetMetaData("0018|5100", " and ".join(sorted({s.lies for s in slices})))
    return image


def _read_header(file: Path) -> Slice | None:
    """Read a file's header; None if it is not a DICOM image (a note, an index of the folder)."""
    import SimpleITK

    reader = SimpleITK.ImageFileReader()
    reader.SetImageIO("GDCMImageIO")
    reader.SetFileName(str(file))
    try:
        reader.ReadImageInformation()
    except RuntimeError as error:
        if _is_damaged_slice(file):
            raise InputError(_DAMAGED.format(file)) from error
        return None
    if not reader.HasMetaDataKey("0008|0060"):
        return None

    def text(tag: str) -> str:
        return reader.GetMetaData(tag).strip() if reader.HasMetaDataKey(tag) else ""

    def numbers(tag: str, count: int) -> np.ndarray:
        try:
            values = np.array([float(word) for word in text(tag).split("\\")])
        except ValueError:
            values = np.empty(0)
        return values if len(values) == count else np.full(count, np.nan)

    return Slice(
        file,
        text("0020|000e"),
        text("0008|0060"),
        numbers("0020|0032", 3),
        numbers("0020|0037", 6),
        (reader.GetSize(), *numbers("0028|0030", 2).tolist()),
        text("0018|5100"),
    )


def _is_damaged_slice(file: Path) -> bool:
    """Test whether a file that cannot be read as an image is a damaged slice, not a note or the folder's index.

    It begins as DICOM does, with 128 bytes that are mostly zero and four letters, or ends within these.
    """
    with file.open("rb") as begin:
        head = begin.read(132)
    return (
        not file.name.startswith(".") and file.name != "DICOMDIR" and (not head.strip(b"\0") or head[128:] == b"DICM")
    )


def _rescaled_values(file: Path) -> np.ndarray:
    import SimpleITK

    try:
        return SimpleITK.GetArrayFromImage(SimpleITK.ReadImage(str(file)))[0]
    except RuntimeError as error:
        raise InputError(_DAMAGED.format(file)) from error


def _check_series(folder: Path, slices: list[Slice], modality: str) -> None:
    """Raise InputError unless the slices are several of one series of one modality on one grid."""
    if not slices:
        raise InputError(f"{folder}: no file in it is a DICOM image; give the folder of slices, or the file of a mesh.")
    for s in slices:
        if s.modality != _TAGS[modality]:
            remedy = next((f" or say modality: {name}" for name, tag in _TAGS.items() if tag == s.modality), "")
            raise InputError(
                f"{s.file}: its modality is {s.modality}; give a folder with {_TAGS[modality]} slices only{remedy}."
            )
    series = {s.series for s in slices}
    if len(series) > 1:
        raise InputError(f"{folder}: it holds {len(series)} series; put the one to use in a folder of its own.")
    any_slice = slices[0]
    for s in slices:
        if not np.isfinite([*s.position, *s.orientation, *s.grid[1:]]).all() or s.grid[0][2:] not in ((), (1,)):
            raise InputError(
                f"{s.file}: it is not one slice with a position, orientation and pixel spacing; "
                "convert the series to NIfTI first."
            )
        if s.grid != any_slice.grid or np.abs(s.orientation - any_slice.orientation).max() > 1e-3:
            raise InputError(f"{s.file}: its pixels or orientation differ from {any_slice.file.name}'s; remove it.")
    if len(slices) == 1:
        raise InputError(f"{folder}: it holds a single slice; give the whole series.")


def _slice_distance(folder: Path, slices: list[Slice], normal: np.ndarray) -> float:
    """Compute the distance between neighbouring slices [mm], which must be uniform."""
    moves = np.diff([s.position for s in slices], axis=0)
    along = moves @ normal
    step = float(np.median(along))
    coincide = along.min() < UNEVEN * step or step <= 0
    deviation = np.abs(moves - np.median(moves, axis=0)).max(axis=1)
    worst = int(np.argmin(along) if coincide else np.argmax(deviation))
    pair = f"{slices[worst].file.name} and {slices[worst + 1].file.name}"
    if coincide:
        raise InputError(f"{folder}: {pair} lie at the same place; keep one of them.")
    if deviation[worst] > UNEVEN * step:
        raise InputError(
            f"{folder}: a slice is missing or out of place, since {pair} are {np.linalg.norm(moves[worst]):.3g} mm "
            f"apart and most others {step:.3g} mm; give the whole series."
        )
    return step
