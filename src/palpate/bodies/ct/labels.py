"""Labels of a mask: their names and volumes, and the choice of those that a body is made of."""

import gzip
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from palpate.errors import InputError, suggest

if TYPE_CHECKING:
    import SimpleITK

# bytes of the header of NIfTI-1 and NIfTI-2, where each states the place of the first voxel, and as what
_HEADERS = {348: (108, "f4"), 540: (168, "i8")}


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
        packed = file.read(2) == b"\x1f\x8b"
    with gzip.open(path) if packed else path.open("rb") as file:
        size = file.read(4)
        order = next((o for o in "<>" if int(np.frombuffer(size, f"{o}i4", 1)[0]) in _HEADERS), None)
        if order is None:
            return {}
        header = int(np.frombuffer(size, f"{order}i4", 1)[0])
        place, kind = _HEADERS[header]
        rest = size + file.read(header - 4)
        extensions = file.read(max(int(np.frombuffer(rest, f"{order}{kind}", 1, place)[0]) - header, 0))
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
