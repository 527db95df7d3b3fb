"""Recognise what a user's files are: a mesh, or a CT with or without a mask; and the sides that may hold the body."""

import re
import unicodedata
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.bodies.ct.config_scan import described
from palpate.bodies.ct.image import FORMATS, label_names, read_labels
from palpate.bodies.make_body import taken
from palpate.bodies.mesh_file import (
    KEPT_NODES,
    ORGAN_M,
    RARE_UNITS,
    UNITS,
    guess_scale,
    in_words,
    load_shape,
    organ_sized,
)
from palpate.bodies.mesh_readers import read
from palpate.bodies.settings import Ct, File, Region
from palpate.errors import InputError

MATERIAL: dict[str, Any] = {"young_pa": 3000, "poisson": 0.3, "density_kg_m3": 1050}
"""Of soft tissue, unless the user knows better."""
_OF_MESH = {
    "below": ("z", "min"),
    "above": ("z", "max"),
    "left": ("x", "min"),
    "right": ("x", "max"),
    "front": ("y", "min"),
    "back": ("y", "max"),
}
"""In a mesh z points up, and x to the right of whoever looks at its front."""
# of a patient, in an image or a mesh with a frame: x points to the left hand, y to the back, z to the head
_OF_PATIENT = _OF_MESH | {"left": ("x", "max"), "right": ("x", "min")}
_BY_AXIS = {f"{axis}-{side}": (axis, side) for axis in "xyz" for side in ("min", "max")}

HOLDS = (*_OF_MESH, *_BY_AXIS)  # the words that name a side


def sides_of(kind: str, hold: str | None) -> list[tuple[str, str]]:
    """Return the sides, as axis and end, that may hold a body: the one that is named, or all that suit its kind.

    kind : of the body as ``lies_as`` has it; "ct" is a patient, who lies on the back
    """
    if hold is not None:
        return [(_BY_AXIS | (_OF_PATIENT if kind == "ct" else _OF_MESH))[hold]]
    return [_OF_PATIENT["back"]] if kind == "ct" else list(_BY_AXIS.values())


def lies_as(entry: File | Ct) -> str:
    """Return the kind of a body, or "ct" for a mesh whose header names the frame of a patient."""
    return "ct" if isinstance(entry, File) and read(Path(entry.path)).frame else entry.kind


# length [m] that a mesh gets whose unit cannot be guessed
ASSUMED_M = 0.2
# longest sides [units of the file] of organs in micrometres to metres, with a factor of 10 to spare at both ends
POSSIBLE_UNITS = (0.1 * ORGAN_M[0], 10.0 * ORGAN_M[1] / UNITS["micrometre"])


@dataclass(frozen=True)
class Data:
    """Content of the files: the body's settings that follow, comments on some of them, and lines to print.

    found, assumed, warned : what is in the files, what is taken for granted of it, and where that may well be wrong
    lies : the side of ``HOLDS`` below, if the files say another than what suits their kind
    """

    name: str
    entry: File | Ct
    comments: dict[str, str]
    found: list[str]
    assumed: list[str]
    warned: list[str] = field(default_factory=list)
    lies: str = ""

    def announce(self) -> None:
        """Print the lines, before what takes long."""
        for word, lines in (("found   ", self.found), ("assumed ", self.assumed), ("warning:", self.warned)):
            for line in lines:
                print(word, line, flush=True)


def recognise(
    paths: Sequence[Path],
    label: Sequence[int | str] = (),
    threshold_hu: Sequence[float] | None = None,
    regions: bool = False,
    mri: bool = False,
    scale_m: float | None = None,
) -> Data:
    """Look at one mesh, or at a CT and perhaps its mask; InputError with one sentence if they cannot be used.

    label : of the mask, as numbers or names; several are joined
    threshold_hu : lowest and highest CT number of the organ, or grey value in an MRI, without a mask
    regions : whether all labels but the largest become regions of the body, with a stiffness of their own
    mri : whether the image is an MRI, not a CT
    scale_m : length of a mesh file's unit [m]; guessed if it is not given
    """
    image, mask = paths[0], paths[1] if len(paths) > 1 else None
    for path in paths:
        if not path.exists():
            raise InputError(f"{path}: there is no such file or folder; give a mesh, or a CT and perhaps its mask.")
    if not (image.is_dir() or image.name.lower().endswith(FORMATS)):
        if mask is not None or label or threshold_hu:
            raise InputError(f"{image}: a mesh takes no mask, label or threshold; give the mesh alone, or a CT first.")
        return _mesh(image, scale_m)
    if scale_m is not None:
        raise InputError(f"{image}: an image knows its own unit; leave --scale out.")
    if mask is None and label:
        raise InputError(f"{image}: a label needs a mask; give the mask after the CT.")
    if mask is not None and threshold_hu:
        raise InputError(f"{image}: with a mask the threshold is not used; give one of the two.")
    if mri and mask is None and not threshold_hu:
        raise InputError(
            f"{image}: grey values of an MRI have no unit, so no range of them is usual; give a mask or --threshold."
        )
    if regions:
        labels = labels_of(paths, label)
        if len(labels) < 2:
            raise InputError(f"{mask}: regions need two labels at least; leave --regions out, or name more.")
    data = _ct(image, mask, labels if regions else list(label), threshold_hu, regions, mri)
    assert isinstance(data.entry, Ct)
    lines, side = described(data.entry)
    if not side:
        data.assumed.append("the patient lay on the back, as the header does not say how; else give --hold")
    return replace(data, found=lines, lies=side if side != "back" else "")


def labels_of(paths: Sequence[Path], label: Sequence[int | str]) -> list[int | str]:
    """Return the labels of the mask among the files that are asked for, or all, the largest first."""
    if len(paths) < 2:
        raise InputError(f"{paths[0]}: bodies or regions by label need a mask; give the mask after the CT.")
    in_mask = read_labels(paths[1])
    if missing := [str(each) for each in label if each not in in_mask]:
        known = ", ".join(map(str, in_mask))
        raise InputError(f"{paths[1]}: the mask has no label {', '.join(missing)}; it has {known}.")
    return [each for each in in_mask if not label or each in label]


def _mesh(path: Path, scale_m: float | None) -> Data:
    """Describe the body of a mesh file, whose unit is ``scale_m`` [m] long, or of guessed length where that is None."""
    with warnings.catch_warnings(action="ignore"):  # the frame is said below
        points, triangles, tetrahedra = load_shape(path)
    size = float(np.ptp(points, axis=0).max())
    scale, source = _scale(path, size, scale_m)
    entry = File(path=str(path), scale_m=scale, **MATERIAL)
    counts = f"{len(points)} nodes" if tetrahedra is None else f"{len(tetrahedra)} tetrahedra, {len(points)} nodes"
    length, kind = in_words(scale * size), "surface" if tetrahedra is None else "tetrahedra"
    comments = {
        "kind": "a mesh in a file",
        "path": f"seen from this folder; {kind}, {len(triangles)} triangles on the surface",
        "scale_m": f"length of the file's unit [m], {source}; the longest side is {length}",
    }
    if tetrahedra is None and len(points) > KEPT_NODES:
        entry = entry.but(surface_nodes=140, snap=False)
    lines = [f"{path}: {kind}, {len(triangles)} triangles on the surface, {counts}", *taken(entry, source)]
    data = Data(body_name(path.name.removesuffix(path.suffix)), entry, comments, lines, [])
    if scale_m is not None:
        return data
    assumed = (
        f"a unit of the file is {scale:g} m ({source}), so that its longest side of {size:.4g} is {length}; "
        f"--scale {2 * scale:g} makes it twice as long"
    )
    return replace(data, assumed=[assumed], warned=_doubts(path, size, scale))


def _scale(path: Path, size: float, scale_m: float | None) -> tuple[float, str]:
    """Return the length of the file's unit [m], and how it is known."""
    if scale_m is not None:
        return scale_m, "given"
    if (guess := guess_scale(size)) is not None:
        return guess[1], "guessed from the size"
    if not POSSIBLE_UNITS[0] <= size <= POSSIBLE_UNITS[1]:
        raise InputError(
            f"{path}: its longest side is {size:.3g} units, an organ's in no unit from micrometres to metres; "
            f"give --scale, the unit's length in metres ({ASSUMED_M / size:.3g} makes it {in_words(ASSUMED_M)} long)."
        )
    return float(f"{ASSUMED_M / size:.3g}"), "not known"


def _doubts(path: Path, size: float, scale: float) -> list[str]:
    """Return a line if the file's unit may well be another than the assumed one."""
    phrases = [
        f"the {name}, which makes it {in_words(unit_m * size)} long (--scale {unit_m:g})"
        for name, unit_m in organ_sized(size, UNITS | RARE_UNITS).items()
        if unit_m != scale
    ]
    if not phrases and guess_scale(size):
        return []
    unit = f"its unit may be {', or '.join([*phrases, 'one of its own'])}"
    return [f"{path}: {unit}; compare the length with the organ's, and give --scale"]


def _ct(
    image: Path, mask: Path | None, label: list[int | str], threshold: Sequence[float] | None, regions: bool, mri: bool
) -> Data:
    """Describe the organ of an image; with ``regions`` all labels but the first, the largest, are regions of it."""
    options: dict[str, Any] = {"modality": "mri"} if mri else {}
    assumed = []
    if mask is not None:
        options["mask"] = str(mask)
        if label:
            options["label"] = label[0] if len(label) == 1 else label
    elif threshold:
        options["threshold" if mri else "threshold_hu"] = list(threshold)
    else:
        options["threshold_hu"] = [30, 120]
        assumed.append("the organ is the largest piece between 30 and 120 HU; else give a mask or --threshold")
    if regions:
        named = {body_name(each if isinstance(each, str) else f"label {each}"): each for each in label[1:]}
        options["regions"] = {name: Region(label=each, young_pa=MATERIAL["young_pa"]) for name, each in named.items()}
    main = label[0] if label else ""
    name = label_names(mask).get(main) if mask is not None and isinstance(main, int) else main
    source = re.sub(r"(\.nii)?\.\w+$", "", str(name or (mask or image).name))
    entry = Ct(image=str(image), surface_nodes=140, snap=False, **options, **MATERIAL)
    return Data(body_name(source), entry, {"kind": "an organ in a CT"}, [], assumed)


def body_name(text: str) -> str:
    """Make a body's name of a file's: lower-case letters, digits and underscores, the first a letter."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().lower()
    name = re.sub(r"[^a-z0-9]+", "_", plain).strip("_")
    return name if re.match("[a-z]", name) else f"body_{name}".rstrip("_")
