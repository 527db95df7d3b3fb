"""CT and MRI images on a right-handed grid in metres, and masks of their voxels, from files and DICOM folders."""

import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from palpate.bodies.ct.headers import NIFTI, ROUNDED, SAME_GRID, angle_deg, apart, check_header, extensions, orthonormal
from palpate.bodies.settings import POSSIBLE_M
from palpate.errors import InputError, suggest

if TYPE_CHECKING:
    import SimpleITK

AIR_HU = -1024
FRAME, POSITION = "frame", "0018|5100"
"""Keys of metadata: which header entry says where the axes point, and how the patient lay, which is DICOM's."""
FORMATS = (*NIFTI, ".nrrd", ".nhdr", ".mhd", ".mha")


class Grid:
    """A regular grid of voxels: of a CT's image, or around a surface.

    origin_m : (3,) [m], x y z of the centre of voxel (0, 0, 0)
    spacing_m : (3,) [m] between voxel centres along x, y and z
    axes : (3, 3), its axes as columns in the scanner's frame, where places are; the origin is along its own axes
    source : its name in messages; too_thin : what is wrong with a body that its voxels do not resolve, and the remedy
    """

    too_thin = (
        "the organ is too thin for its slices, and falls apart when they are smoothed; give thinner slices or another "
        "mask"
    )
    origin_m: np.ndarray
    spacing_m: np.ndarray
    source: str
    axes: np.ndarray = np.eye(3)

    @property
    def voxel_m3(self) -> float:
        """Volume of a voxel [m³]."""
        return float(np.prod(self.spacing_m))

    @property
    def matrix(self) -> np.ndarray:
        """The matrix (3, 4) from indices x y z to places [m]."""
        return np.column_stack([self.axes * self.spacing_m, self.turned(self.origin_m)])

    def along_axes(self, index: np.ndarray) -> np.ndarray:
        """Convert array indices, (n, 3) in z y x, possibly fractional, to coordinates along the grid's axes [m]."""
        return self.origin_m + np.asarray(index)[..., ::-1] * self.spacing_m

    def turned(self, points: np.ndarray) -> np.ndarray:
        """Convert coordinates along the grid's axes, (n, 3) [m], to places in the scanner's frame."""
        return points @ self.axes.T

    def to_world(self, index: np.ndarray) -> np.ndarray:
        """Convert array indices, (n, 3) in z y x, possibly fractional, to places, (n, 3) [m] in x y z."""
        return self.turned(self.along_axes(index))

    def to_index(self, points: np.ndarray) -> np.ndarray:
        """Convert points, (n, 3) [m], to array indices, (n, 3) in z y x: the inverse of ``to_world``."""
        return ((np.asarray(points) @ self.axes - self.origin_m) / self.spacing_m)[..., ::-1]


@dataclass(frozen=True, eq=False)
class Image(Grid):
    """A CT or an MRI on a regular grid: x to the patient's left, y to the back, z to the head, or the nearest to these.

    hu : (nz, ny, nx), int16 or float32; of a CT [HU] and nowhere below air, of an MRI grey values without a unit
    modality : "ct" or "mri"; only the grey values of a CT say how dense tissue is
    frame : header entry that says where the axes point; position : how the patient lay, as in DICOM, "" if unknown
    """

    hu: np.ndarray
    origin_m: np.ndarray
    spacing_m: np.ndarray
    source: str = "image"
    axes: np.ndarray = field(default_factory=lambda: np.eye(3))
    modality: str = "ct"
    frame: str = ""
    position: str = ""

    def cropped(self, box: tuple[slice, ...]) -> "Image":
        """Return the part in ``box``, slices along z, y and x that have a start."""
        return replace(self, hu=self.hu[box], origin_m=self.along_axes(np.array([side.start for side in box])))


def read(path: str | Path, modality: str = "ct") -> Image:
    """Read the image in a NIfTI, NRRD or MetaImage file or in a folder of DICOM slices.

    Raises InputError if it is not of the ``modality``, "ct" or "mri". Files other than DICOM do not say what they are;
    a CT has values below 0 HU.
    Traps: scanners pad with −2000 or −3024 outside their circle, which becomes air here, so that no interpolation or
    density takes it for tissue; a grid of left-handed axes is flipped, not only relabelled.
    """
    from palpate.bodies.ct.dicom import read_folder

    path = Path(path)
    file = read_folder(path, modality) if path.is_dir() else _read_file(path)
    image = _placed(path, file)
    hu = image.hu
    if not np.isfinite(hu).all():
        air = f"air, {AIR_HU} HU" if modality == "ct" else "0"
        raise InputError(f"{path}: it has voxels that are not finite numbers; fill them with {air}.")
    if hu.min() == hu.max():
        expected = "a CT in Hounsfield units" if modality == "ct" else "an MRI"
        raise InputError(f"{path}: every voxel is {hu.min() + 0.0:g}; give {expected}.")
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
    longest = float((image.spacing_m * hu.shape[::-1]).max())
    if not POSSIBLE_M[0] <= longest <= POSSIBLE_M[1]:
        raise InputError(f"{path}: it is {longest:.3g} m long, if its header counts in mm; write the header in mm.")
    frame, position = (file.GetMetaData(key) if file.HasMetaDataKey(key) else "" for key in (FRAME, POSITION))
    if not frame:
        warnings.warn(
            f"{path}: its header does not say where its axes point; they are taken to point to the patient's left, "
            "back and head, so look on which side the body lies.",
            stacklevel=2,
        )
    if np.linalg.det(np.reshape(file.GetDirection(), (3, 3))) < 0:
        frame += " (left-handed, and flipped)"
    hu = np.maximum(hu, AIR_HU) if modality == "ct" else hu
    return replace(image, hu=hu, modality=modality, frame=frame, position=position)


LABELS, VOXELS_OF_LABEL = 150, 100
"""Values that a mask has at most, and voxels that it has at least for each of them."""


def _holds_labels(values: np.ndarray) -> bool:
    """Test whether the values of voxels are those of a mask: 0 and a few other whole numbers above it."""
    if values.min() != 0 or values.max() != np.round(values.max()):
        return False
    distinct = np.unique(values)
    return (
        len(distinct) <= LABELS
        and VOXELS_OF_LABEL * len(distinct) <= values.size
        and bool((distinct == np.round(distinct)).all())
    )


def read_mask(path: Path, image: Image, label: int | str | Sequence[int | str] | None = None) -> np.ndarray:
    """Read a mask of ``image``'s voxels, (nz, ny, nx) bool; raise InputError if it is empty or on another grid.

    label : number or name of the label to take, or several to join; needed only if the mask has several
    """
    file = _read_file(path)
    names = label_names(path, file)
    mask = _placed(path, file)
    if file.HasMetaDataKey("Segmentation_ReferenceImageExtentOffset"):
        mask = _uncropped(mask, image)
    offset_voxels = apart(image.matrix, mask.matrix, image.hu.shape[::-1])
    if mask.hu.shape != image.hu.shape or offset_voxels > ROUNDED:
        fault = f"{path}: the mask is on another grid than {image.source}: {_differences(mask, image)}"
        if mask.hu.shape != image.hu.shape or offset_voxels > SAME_GRID:
            raise InputError(f"{fault}; resample it to the image's grid.")
        warnings.warn(f"{fault}; these are {offset_voxels:.1g} voxels, and the image's grid is taken.", stacklevel=3)
    return choose(path, mask.hu, names, label, image.voxel_m3)


def read_labels(path: Path) -> dict[int | str, int]:
    """Read the labels of a mask, by their names where the file has any, and their voxels; the largest first."""
    file = _read_file(path)
    names = label_names(path, file)
    numbers, counts = np.unique(_array(file), return_counts=True)
    sizes = {names.get(int(n), int(n)): int(count) for n, count in zip(numbers, counts, strict=True) if n}
    return dict(sorted(sizes.items(), key=lambda item: -item[1]))


def _uncropped(mask: Image, image: Image) -> Image:
    """Enlarge a mask that 3D Slicer has cropped to its segments to the grid of ``image``.

    A mask of voxels that are not the image's is returned as it is, for the caller to refuse.
    """
    offset = np.round(image.to_index(mask.to_world(np.zeros(3)))).astype(int)
    box = tuple(slice(start, start + count) for start, count in zip(offset, mask.hu.shape, strict=True))
    if offset.min() < 0 or any(side.stop > count for side, count in zip(box, image.hu.shape, strict=True)):
        return mask
    uncropped = np.zeros(image.hu.shape, dtype=mask.hu.dtype)
    uncropped[box] = mask.hu
    return replace(mask, hu=uncropped, origin_m=mask.along_axes(-offset))


def _differences(mask: Image, image: Image) -> str:
    """Describe how the grids of a mask and of an image differ."""
    angle = angle_deg(mask.axes, image.axes)
    offset_mm = 1e3 * float(np.linalg.norm(mask.matrix[:, 3] - image.matrix[:, 3]))
    words = [f"turned by {angle:.2g}°"] if angle > 1e-4 else []
    words += [f"begins {offset_mm:.3g} mm away"] if offset_mm > 1e-3 else []
    compared: tuple = (mask.hu.shape[::-1], image.hu.shape[::-1]), (1e3 * mask.spacing_m, 1e3 * image.spacing_m)
    for name, values in zip(("{} voxels instead of {}", "voxels of {} mm instead of {}"), compared, strict=True):
        of_mask, of_image = ("×".join(f"{side:.6g}" for side in each) for each in values)
        words += [name.format(of_mask, of_image)] if of_mask != of_image else []
    return ", ".join(words)


def _read_file(path: Path) -> "SimpleITK.Image":
    """Read an image file by SimpleITK; InputError if that fails, or if it is no single volume of scalars."""
    import SimpleITK

    if not path.is_file():
        raise InputError(f"{path}: this file does not exist; give a CT or a mask as {', '.join(FORMATS)}.")
    if not path.name.lower().endswith(FORMATS):
        raise InputError(f"{path}: its name ends in none of {', '.join(FORMATS)}; for DICOM give the folder.")
    frame = check_header(path)
    try:
        image = SimpleITK.ReadImage(str(path))
    except RuntimeError as error:
        reason = " ".join(str(error).rpartition("ERROR: ")[2].split()).rstrip(".!")
        raise InputError(f"{path}: SimpleITK cannot read it ({reason}); write or download it again.") from error
    components = image.GetNumberOfComponentsPerPixel()
    if components > 1 and image.HasMetaDataKey("Segment0_Name"):
        raise InputError(
            f"{path}: its segments overlap and lie in {components} layers; export those to use as one label map "
            "(in 3D Slicer: Segmentations, Export)."
        )
    if image.GetDimension() != 3 or components != 1:
        raise InputError(f"{path}: it is not a single volume of scalars; extract one 3-D volume from it.")
    image.SetMetaData(FRAME, frame)
    return image


def _placed(path: Path, file: "SimpleITK.Image") -> Image:
    """Turn voxels to the patient's axes by quarter turns and flips; InputError if the file's axes are sheared."""
    import SimpleITK

    oriented = SimpleITK.DICOMOrient(file, "LPS")
    spacing, counts = np.array(oriented.GetSpacing()), np.array(oriented.GetSize())
    axes = orthonormal(path, np.reshape(oriented.GetDirection(), (3, 3)), spacing, counts)
    origin = axes.T @ np.array(oriented.GetOrigin())
    if (np.abs((axes - np.eye(3)) * spacing) @ counts).max() < ROUNDED * spacing.min():
        axes = np.eye(3)
    return Image(_array(oriented), origin / 1e3, spacing / 1e3, str(path), axes)


def _array(image: "SimpleITK.Image") -> np.ndarray:
    """Convert the voxels to (nz, ny, nx), as int16 where that is lossless and else as float32."""
    import SimpleITK

    values = SimpleITK.GetArrayFromImage(image)
    fits_int16 = values.dtype.kind in "iub" and values.min() >= -(2**15) and values.max() < 2**15
    return values.astype(np.int16 if fits_int16 else np.float32)


def label_names(path: Path, image: "SimpleITK.Image | None" = None) -> dict[int, str]:
    """Return the names of labels that a mask's file has, by their numbers; empty if it has none.

    TotalSegmentator and Connectome Workbench write a table into the header of a NIfTI file (an XML extension), 3D
    Slicer the keys ``Segment<n>_Name`` and ``Segment<n>_LabelValue`` into that of an NRRD file.
    """
    if path.name.lower().endswith(NIFTI):
        table = re.search(rb"<LabelTable.*?</LabelTable>", extensions(path), re.DOTALL)
        try:
            labels = list(ElementTree.fromstring(table[0])) if table else []
        except ElementTree.ParseError:
            return {}
        names = {label.get("Key", ""): (label.text or "").strip() for label in labels}
        return {int(number): name for number, name in names.items() if number.isdigit() and name}
    image = image or _read_file(path)
    name_of_label = {}
    for key in image.GetMetaDataKeys():
        if (match := re.fullmatch(r"Segment(\d+)_LabelValue", key)) and image.GetMetaData(key).strip().isdigit():
            name = f"Segment{match[1]}_Name"
            name_of_label[int(image.GetMetaData(key))] = (
                image.GetMetaData(name).strip() if image.HasMetaDataKey(name) else ""
            )
    return {number: name for number, name in name_of_label.items() if name}


def _volume(ml: float) -> str:
    return f"{ml:.0f} mL" if ml >= 10 else f"{ml:.2g} mL"


LISTED = 8
"""Labels that a message lists, largest first."""


def choose(
    path: Path,
    values: np.ndarray,
    names: dict[int, str],
    wanted: int | str | Sequence[int | str] | None,
    voxel_m3: float,
) -> np.ndarray:
    """Return the voxels (nz, ny, nx) bool of the wanted labels; InputError if one is missing, or it is not clear which.

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
    sizes = dict(zip(labels.tolist(), (1e6 * voxel_m3 * counts).tolist(), strict=True))
    if wanted is None:
        if len(sizes) > 1:
            raise InputError(
                f"{path}: the mask has {describe(sizes, names)}; "
                "choose with label, a number or a name or a list of them to join."
            )
        return values != 0
    chosen = [wanted] if isinstance(wanted, int | str) else wanted
    lacks = f"{path}: the mask has no voxel of label"
    return np.isin(values, [value for label in chosen for value in numbers_of(lacks, label, sizes, names)])


def describe(sizes: Mapping[int, float], names: Mapping[int, str], said: Callable[[float], str] = _volume) -> str:
    """List labels with their names and sizes, largest first: "104 labels: 5 liver (1023 mL), … and 96 more".

    sizes : label → size; said : writes a size, by default a volume [mL]
    """
    by_size = sorted(sizes, key=lambda label: (-sizes[label], label))
    described = [f"{label:g} {names.get(label, '')}".strip() + f" ({said(sizes[label])})" for label in by_size[:LISTED]]
    rest_words = f" and {len(sizes) - LISTED} more" if len(sizes) > LISTED else ""
    return f"{len(sizes)} label{'s' if len(sizes) > 1 else ''}: {', '.join(described)}{rest_words}"


def numbers_of(
    lacks: str,
    label: int | str,
    sizes: Mapping[int, float],
    names: Mapping[int, str],
    said: Callable[[float], str] = _volume,
) -> list[int]:
    """Return the numbers of a label that is given by number or name; two labels may have one name.

    sizes, names, said : as ``describe`` has them; lacks : begins the InputError where there is no such label
    """
    numbers = [number for number in sizes if (names.get(number) if isinstance(label, str) else number) == label]
    if numbers:
        return numbers
    known_names = [names[number] for number in sizes if number in names]
    hint = ""
    if isinstance(label, str) and label in names.values():
        hint = ", though the file names it"
    elif isinstance(label, str) and not known_names:
        hint = " (the file has no names, so give a number)"
    elif isinstance(label, str) and (guess := suggest(label, known_names, "")).startswith("did"):
        hint = f" ({guess})"
    raise InputError(f"{lacks} {label}{hint}; it has {describe(sizes, names, said)}.")
