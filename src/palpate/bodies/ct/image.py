"""CT and MRI images on a right-handed grid in metres, and masks of their voxels, from files and DICOM folders."""

import gzip
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from palpate.errors import InputError, suggest

if TYPE_CHECKING:
    import SimpleITK

_GZIP = b"\x1f\x8b"
# by the size of the header, which its first four bytes give: offset and type of the eight dimensions, of the voxels'
# type, of the bits of each voxel and of the position of the first one
_HEADERS = {
    348: ((40, "i2"), (70, "i2"), (72, "i2"), (108, "f4")),  # NIfTI-1
    540: ((16, "i8"), (12, "i2"), (14, "i2"), (168, "i8")),  # NIfTI-2
}
_FLOATS = {16: "f4", 64: "f8"}


def _byte_order(data: bytes) -> tuple[str, int]:
    """Return the byte order of a NIfTI file and the size of its header, 0 if it is none."""
    sizes = [(order, int(np.frombuffer(data, f"{order}i4", 1)[0])) for order in "<>" if len(data) >= 4]
    return next((found for found in sizes if found[1] in _HEADERS), ("", 0))


def _check(path: Path) -> None:
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
    order, header = _byte_order(data)
    if not header:
        return
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


AIR_HU = -1024
FORMATS = (".nii", ".nii.gz", ".nrrd", ".nhdr", ".mhd", ".mha")
# difference, in voxels, up to which two grids count as the same: headers are rounded
SAME_GRID = 1e-2


class Grid:
    """A regular grid of voxels: of a CT's image, or around a surface.

    origin_m : (3,) [m], x y z of the centre of voxel (0, 0, 0)
    spacing_m : (3,) [m] between voxel centres along x, y and z
    source : its name in messages; too_thin : what is wrong with a body that its voxels do not resolve, and the remedy
    """

    too_thin = (
        "the organ is too thin for its slices, and falls apart when they are smoothed; give thinner slices or another "
        "mask"
    )
    origin_m: np.ndarray
    spacing_m: np.ndarray
    source: str

    @property
    def voxel_m3(self) -> float:
        """Volume of a voxel [m³]."""
        return float(np.prod(self.spacing_m))

    def to_world(self, index: np.ndarray) -> np.ndarray:
        """Convert array indices, (n, 3) in z y x, possibly fractional, to coordinates, (n, 3) [m] in x y z."""
        return self.origin_m + np.asarray(index)[..., ::-1] * self.spacing_m

    def to_index(self, points: np.ndarray) -> np.ndarray:
        """Convert points, (n, 3) [m], to array indices, (n, 3) in z y x: the inverse of ``to_world``."""
        return ((np.asarray(points) - self.origin_m) / self.spacing_m)[..., ::-1]


@dataclass(frozen=True, eq=False)
class Image(Grid):
    """A CT or an MRI on a regular grid: x to the patient's left, y to the back, z to the head.

    hu : (nz, ny, nx), int16 or float32; of a CT [HU] and nowhere below air, of an MRI grey values without a unit
    modality : "ct" or "mri"; only the grey values of a CT say how dense tissue is
    axes : (3, 3), the grid's axes as columns in the patient's frame. Trap: coordinates here are along the grid's
        own axes, which in an oblique scan are rotated against the patient's; a body is not affected.
    """

    hu: np.ndarray
    origin_m: np.ndarray
    spacing_m: np.ndarray
    source: str = "image"
    axes: np.ndarray = field(default_factory=lambda: np.eye(3))
    modality: str = "ct"

    def cropped(self, box: tuple[slice, ...]) -> "Image":
        """Return the part in ``box``, slices along z, y and x that have a start."""
        return replace(self, hu=self.hu[box], origin_m=self.to_world(np.array([side.start for side in box])))


def read(path: str | Path, modality: str = "ct") -> Image:
    """Read the image in a NIfTI, NRRD or MetaImage file or in a folder of DICOM slices.

    Raises InputError if it is not of the ``modality``, "ct" or "mri". Files other than DICOM do not say what they are;
    a CT has values below 0 HU.
    Traps: scanners pad with −2000 or −3024 outside their circle, which becomes air here, so that no interpolation or
    density takes it for tissue; a grid of left-handed axes is flipped, not only relabelled.
    """
    from palpate.bodies.ct.dicom import read_folder

    path = Path(path)
    image = _oriented(read_folder(path, modality) if path.is_dir() else _read_file(path))
    hu = _array(image)
    if not np.isfinite(hu).all():
        air = f"air, {AIR_HU} HU" if modality == "ct" else "0"
        raise InputError(f"{path}: it has voxels that are not finite numbers; fill them with {air}.")
    if hu.min() == hu.max():
        wanted = "a CT in Hounsfield units" if modality == "ct" else "an MRI"
        raise InputError(f"{path}: every voxel is {hu.min() + 0.0:g}; give {wanted}.")
    if _holds_labels(hu):
        raise InputError(
            f"{path}: its values are a few whole numbers from 0 to {hu.max():g}, as of a mask and not of an image; "
            "give the image first, and then the mask."
        )
    if modality == "ct" and hu.min() >= 0:
        raise InputError(
            f"{path}: no voxel is below 0 HU, so this is not a CT in Hounsfield units; "
            "give one, with its rescale slope and intercept applied, or say modality: mri."
        )
    return Image(np.maximum(hu, AIR_HU) if modality == "ct" else hu, *_grid(image), str(path), _axes(image), modality)


LABELS, VOXELS_OF_LABEL = 150, 100
"""Values that a mask has at most, and voxels that it has at least for each of them."""


def _holds_labels(values: np.ndarray) -> bool:
    """Test whether the values of voxels are those of a mask: 0 and a few other whole numbers above it."""
    if values.min() != 0 or values.max() != np.round(values.max()):
        return False
    found = np.unique(values)
    return (
        len(found) <= LABELS and VOXELS_OF_LABEL * len(found) <= values.size and bool((found == np.round(found)).all())
    )


def read_mask(path: str | Path, image: Image, label: int | str | Sequence[int | str] | None = None) -> np.ndarray:
    """Read a mask of ``image``'s voxels, (nz, ny, nx) bool; raise InputError if it is empty or on another grid.

    label : number or name of the label to take, or several to join; needed only if the mask has several
    """
    path = Path(path)
    file = _read_file(path)
    names = label_names(path, file)
    found = _oriented(file)
    mask, (origin, spacing) = _array(found), _grid(found)
    if file.HasMetaDataKey("Segmentation_ReferenceImageExtentOffset"):
        mask, origin = _uncropped(mask, origin, image)
    apart = np.abs(origin - image.origin_m) / image.spacing_m
    stretched = np.abs(spacing - image.spacing_m) * image.hu.shape[::-1] / image.spacing_m
    turned = np.abs(_axes(found) - image.axes) * max(image.hu.shape)
    if mask.shape != image.hu.shape or max(apart.max(), stretched.max(), turned.max()) > SAME_GRID:
        raise InputError(
            f"{path}: the mask ({_describe_grid(mask, origin, spacing)}) is on another grid than {image.source} "
            f"({_describe_grid(image.hu, image.origin_m, image.spacing_m)}); resample it to the image's grid."
        )
    return choose(path, mask, names, label, image.voxel_m3)


def read_labels(path: str | Path) -> dict[int | str, int]:
    """Read the labels of a mask, by their names where the file has any, and their voxels; the largest first."""
    path = Path(path)
    file = _read_file(path)
    names = label_names(path, file)
    numbers, counts = np.unique(_array(file), return_counts=True)
    found = {names.get(int(n), int(n)): int(count) for n, count in zip(numbers, counts, strict=True) if n}
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def name_of_label(path: str | Path, number: int) -> str:
    """Return the name that a mask's file has for a label, or "" if it has none."""
    path = Path(path)
    return label_names(path, _read_file(path)).get(number, "")


def _uncropped(mask: np.ndarray, origin: np.ndarray, image: Image) -> tuple[np.ndarray, np.ndarray]:
    """Enlarge a mask that 3D Slicer has cropped to its segments to ``image``'s grid; return it and its new origin.

    One that is not made of voxels of the image stays as it is, to be refused.
    """
    first = np.round((origin - image.origin_m) / image.spacing_m).astype(int)
    box = tuple(slice(start, start + count) for start, count in zip(first[::-1], mask.shape, strict=True))
    if first.min() < 0 or any(side.stop > count for side, count in zip(box, image.hu.shape, strict=True)):
        return mask, origin
    whole = np.zeros(image.hu.shape, dtype=mask.dtype)
    whole[box] = mask
    return whole, origin - first * image.spacing_m


def _read_file(path: Path) -> "SimpleITK.Image":
    import SimpleITK

    if not path.is_file():
        raise InputError(f"{path}: this file does not exist; give a CT or a mask as {', '.join(FORMATS)}.")
    if not path.name.lower().endswith(FORMATS):
        raise InputError(f"{path}: its name ends in none of {', '.join(FORMATS)}; for DICOM give the folder.")
    if path.name.lower().endswith((".nii", ".nii.gz")):
        _check(path)
    try:
        image = SimpleITK.ReadImage(str(path))
    except RuntimeError as error:
        raise InputError(f"{path}: SimpleITK cannot read it; write or download it again.") from error
    layers = image.GetNumberOfComponentsPerPixel()
    if layers > 1 and image.HasMetaDataKey("Segment0_Name"):
        raise InputError(
            f"{path}: its segments overlap and lie in {layers} layers; export those to use as one label map "
            "(in 3D Slicer: Segmentations, Export)."
        )
    if image.GetDimension() != 3 or layers != 1:
        raise InputError(f"{path}: it is not a single volume of scalars; extract one 3-D volume from it.")
    return image


def _oriented(image: "SimpleITK.Image") -> "SimpleITK.Image":
    import SimpleITK

    return SimpleITK.DICOMOrient(image, "LPS")


def _array(image: "SimpleITK.Image") -> np.ndarray:
    """Convert the voxels to (nz, ny, nx), as int16 where that is lossless and else as float32."""
    import SimpleITK

    values = SimpleITK.GetArrayFromImage(image)
    whole = values.dtype.kind in "iub" and values.min() >= -(2**15) and values.max() < 2**15
    return values.astype(np.int16 if whole else np.float32)


def _grid(image: "SimpleITK.Image") -> tuple[np.ndarray, np.ndarray]:
    """Return the origin in the frame of the grid's own axes and the spacing, both (3,) [m]."""
    return _axes(image).T @ np.array(image.GetOrigin()) / 1e3, np.array(image.GetSpacing()) / 1e3


def _axes(image: "SimpleITK.Image") -> np.ndarray:
    return np.array(image.GetDirection()).reshape(3, 3)


def _describe_grid(voxels: np.ndarray, origin: np.ndarray, spacing: np.ndarray) -> str:
    numbers = [*voxels.shape[::-1], *(1e3 * spacing), *(1e3 * origin)]
    return "{}×{}×{} voxels of {:.4g}×{:.4g}×{:.4g} mm from {:.4g}, {:.4g}, {:.4g} mm".format(*numbers)


def label_names(path: Path, image: "SimpleITK.Image") -> dict[int, str]:
    """Return the names of labels that a mask's file has, by their numbers; empty if it has none.

    TotalSegmentator and Connectome Workbench write a table into the header of a NIfTI file (an XML extension), 3D
    Slicer the keys ``Segment<n>_Name`` and ``Segment<n>_LabelValue`` into that of an NRRD file.
    """
    if path.name.lower().endswith((".nii", ".nii.gz")):
        return _of_extensions(path)
    found = {}
    for key in image.GetMetaDataKeys():
        if (match := re.fullmatch(r"Segment(\d+)_LabelValue", key)) and image.GetMetaData(key).strip().isdigit():
            name = f"Segment{match[1]}_Name"
            found[int(image.GetMetaData(key))] = image.GetMetaData(name).strip() if image.HasMetaDataKey(name) else ""
    return {number: name for number, name in found.items() if name}


def _of_extensions(path: Path) -> dict[int, str]:
    """Read the label table in the extensions between a NIfTI file's header and its first voxel."""
    with path.open("rb") as file:
        packed = file.read(2) == _GZIP
    with gzip.open(path) if packed else path.open("rb") as file:
        data = file.read(max(_HEADERS))
        order, header = _byte_order(data)
        if not header:
            return {}
        place, kind = _HEADERS[header][-1]
        first = int(np.frombuffer(data, f"{order}{kind}", 1, place)[0])
        extensions = (data + file.read(max(first - len(data), 0)))[header:first]
    table = re.search(rb"<LabelTable.*?</LabelTable>", extensions, re.DOTALL)
    try:
        labels = list(ElementTree.fromstring(table[0])) if table else []
    except ElementTree.ParseError:
        return {}
    return {
        int(label.get("Key", "")): label.text.strip()
        for label in labels
        if label.get("Key", "").isdigit() and label.text and label.text.strip()
    }


LISTED = 8
"""Labels that a message lists, largest first."""


def choose(
    path: Path,
    values: np.ndarray,
    names: dict[int, str],
    wanted: int | str | Sequence[int | str] | None,
    voxel_m3: float,
) -> np.ndarray:
    """Return the voxels (nz, ny, nx) bool of the wanted labels; InputError if one is not there, or several could be.

    values : (nz, ny, nx), 0 outside
    names : of the labels, as far as the file has them; it may name labels that have no voxel
    wanted : a number, a name, or several of either, joined; None takes the only label that there is
    """
    labels, counts = np.unique(values[values != 0], return_counts=True)
    if not len(labels):
        raise InputError(f"{path}: the mask is empty; give one that marks the organ.")
    if labels[0] < 0:
        raise InputError(
            f"{path}: it has values below 0, as a CT has and no mask; give the CT first, and then the mask, with 0 "
            "outside the organ."
        )
    if len(labels) > 1 and (labels != np.round(labels)).any():
        raise InputError(
            f"{path}: its values are not whole numbers, so they are not labels; "
            "give a mask with 0 outside and one whole number in each organ."
        )
    found = dict(zip(labels.tolist(), (1e6 * voxel_m3 * counts).tolist(), strict=True))
    if wanted is None:
        if len(found) > 1:
            raise InputError(
                f"{path}: the mask has {describe(found, names)}; "
                "choose with label, a number or a name or a list of them to join."
            )
        return values != 0
    chosen = [wanted] if isinstance(wanted, int | str) else wanted
    return np.isin(values, [value for label in chosen for value in _numbers(path, label, found, names)])


def describe(found: dict[int, float], names: dict[int, str]) -> str:
    """List labels with their names and volumes [mL], largest first: "104 labels: 5 liver (1023 mL), … and 96 more"."""
    largest = sorted(found, key=lambda label: (-found[label], label))
    said = [f"{label:g} {names.get(label, '')}".strip() + f" ({_volume(found[label])})" for label in largest[:LISTED]]
    more = f" and {len(found) - LISTED} more" if len(found) > LISTED else ""
    return f"{len(found)} label{'s' if len(found) > 1 else ''}: {', '.join(said)}{more}"


def _numbers(path: Path, label: int | str, found: dict[int, float], names: dict[int, str]) -> list[int]:
    """Return the numbers of a label that is given by number or name; two labels may have one name."""
    numbers = [number for number in found if (names.get(number) if isinstance(label, str) else number) == label]
    if numbers:
        return numbers
    there = [names[number] for number in found if number in names]
    near = ""
    if isinstance(label, str) and label in names.values():
        near = ", though the file names it"
    elif isinstance(label, str) and not there:
        near = " (the file has no names, so give a number)"
    elif isinstance(label, str) and (guess := suggest(label, there, "")).startswith("did"):
        near = f" ({guess})"
    raise InputError(f"{path}: the mask has no voxel of label {label}{near}; it has {describe(found, names)}.")


def _volume(ml: float) -> str:
    return f"{ml:.0f} mL" if ml >= 10 else f"{ml:.2g} mL"
