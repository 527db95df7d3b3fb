"""Names of a mask's labels, where its file has them."""

import gzip
import re
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

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
