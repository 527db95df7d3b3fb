"""Settings of bodies: the source of the mesh, materials, and supports."""

from os.path import isdir, isfile, normpath
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError

from palpate.bodies.material import LAWS, NAMED, PATTERN_EXPONENTIAL, kind_of
from palpate.errors import InputError, describe_unknown, explained
from palpate.files import check_file
from palpate.own_file import LAW_FUNCTIONS, check_source
from palpate.setting_types import (
    Axis,
    Block,
    Count,
    Index,
    Name,
    NotNegative,
    Number,
    Pair,
    Poisson,
    Positive,
    Some,
    Switch,
    Text,
    Three,
    Vector,
    Whole,
    key,
    optional,
)  # fmt: skip

if TYPE_CHECKING:
    from palpate.bodies.body import Body as Nested

Label = Count | Text
Labels = Label | Some[Label]
Law = Annotated[str, Field(pattern=rf"^({'|'.join(LAWS)}|{PATTERN_EXPONENTIAL}|.+\.py)$")]
POSSIBLE_M = (0.002, 5.0)
"""Longest sides [m] that a body may have; others are taken for a wrong unit."""
Refinements = Annotated[Whole, Field(ge=0, le=3)]
Magnitudes = Some[Positive]


class Sphere(Block):
    """The inside of a sphere; as anchors, it holds the nodes there."""

    center_m: Vector = key("Centre [m]")
    radius_m: Positive = key("Radius [m]")


class Region(Block):
    """A part of a body with a material of its own, such as a tumour."""

    tag: Whole | Text | None = optional(
        "Of a body of kind file: number or name of the physical group of a gmsh file (without groups, the number of "
        "its volume), or the number in the cell data of another file"
    )
    sphere: Sphere | None = optional("The inside of a sphere")
    label: Labels | None = optional("Of a ct: number or name of a mask's label, or several; 2 is the synthetic lesion")
    young_pa: Positive = key("Young's modulus [Pa]")
    poisson: Poisson | None = optional("Poisson's ratio; by default the body's")
    density_kg_m3: Positive | None = optional("Density [kg/m³]; by default the body's")


class Plane(Block):
    """What lies within a depth of a body's extreme plane; as anchors, it holds the nodes there."""

    axis: Axis = key("Direction of the plane's normal")
    side: Literal["min", "max"] = key("Which end of the axis")
    depth_m: NotNegative = key("Depth [m]")


class Anchors(Block):
    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})
    nodes: list[Index] | None = optional(
        "Numbers of coarse nodes, counted from 0; not of a remeshed surface", min_length=1
    )
    plane: Plane | None = optional("The nodes within a depth of the body's extreme plane")
    sphere: Sphere | None = optional("The nodes inside a sphere")
    several: list["Anchors"] | None = optional(
        "Several such rules; a node is held that any of them holds", min_length=2
    )


class Bed(Block):
    """An elastic bed: springs under a part of a body's surface."""

    sphere: Sphere = key("Where the springs are; they fade smoothly to zero at its surface")
    facing: Vector | None = optional(
        "A direction; only what has an outward normal within 60° of it, and no other part of the body in it, lies on "
        "the bed"
    )
    stiffness_n_m3: Positive = key("Traction per displacement at the centre [N/m³], in each direction")


RULES = "a plane, a sphere, numbers of nodes, or a list of these"


def as_anchors(value: Any) -> Any:
    """Convert a plane, a sphere, several of them, numbers of nodes or a mask of nodes to settings of anchors."""
    if isinstance(value, np.ndarray):
        value = (np.flatnonzero(value) if value.dtype == bool else value).tolist()
    if isinstance(value, list | tuple) and not len(value):
        raise PydanticCustomError("anchors", "holds nothing; give {rules}, or leave it out", {"rules": RULES})
    if isinstance(value, list | tuple) and all(type(each) is int for each in value):
        return Anchors(nodes=list(value))
    if isinstance(value, Plane):
        return Anchors(plane=value)
    if isinstance(value, Sphere):
        return Anchors(sphere=value)
    if isinstance(value, list | tuple):
        return {"several": [as_anchors(each) for each in value]}
    if not isinstance(value, dict | Anchors):
        raise PydanticCustomError("anchors", "give {rules}", {"rules": RULES})
    return value


Rule = Annotated[Anchors, BeforeValidator(as_anchors)]


class _Body(Block):
    young_pa: Positive = key("Young's modulus [Pa]")
    poisson: Poisson = key("Poisson's ratio")
    density_kg_m3: Positive = key("Density [kg/m³]", 1000)
    anchors: Rule | None = optional(
        "Which coarse nodes are held, by exactly one rule; without it and without a bed, of a body from a file or a "
        "CT, those of the lowest tenth of its longest side"
    )

    def make(self, name: str = "") -> "Nested":
        """Make the body, called ``name`` in messages, or as its kind; InputError as ``bodies.make_body``."""
        from palpate.bodies.make_body import make_body

        with explained():
            return make_body(name or self.kind, self)  # type: ignore[attr-defined, arg-type]

    def paths(self, folder: Path) -> dict[str, str]:
        """Return the paths of the files or folders that the body is made from, by setting, as they can be opened.

        folder : of the settings, from where they are named
        """
        given = {name: getattr(self, name, None) for name in ("path", "image", "mask", "law")}
        if given["law"] and not given["law"].endswith(".py"):
            given["law"] = None
        return {name: normpath(folder / path) for name, path in given.items() if path is not None}

    def seen_from(self, folder: Path) -> Self:
        """Return the body with the paths of its files as they can be opened from here."""
        return self.but(**self.paths(folder))


class Solid(_Body):
    refinements: Refinements = key("How often each tetrahedron is split into eight, down to the fine mesh", 0)
    law: Law | None = optional(
        "Law between deformation and energy: corotational (small strain in a turned frame, the default), "
        "stable_neo_hookean, neo_hookean (no element becomes flat), st_venant_kirchhoff (softens under compression), "
        "exponential(8) with any stiffening from 0, or the path of a Python file of one's own"
    )
    regions: dict[Name, Region] | None = optional(
        "Regions with a material of their own, such as a tumour, by name, each by exactly one of tag, sphere and "
        "label. A coarse tetrahedron belongs to the first that has half of its volume, and so do all that it is split "
        "into; what is in none has the body's own constants",
        min_length=1,
    )
    bed: Bed | None = optional(
        "An elastic bed: springs under the surface in a sphere, beside anchors or instead of them"
    )
    magnitudes: Magnitudes | None = optional(
        "Paper 1's forces at each contact, over the force that reaches the regime's peak"
    )
    train: Whole | None = optional("Paper 1's samples that are trained on", ge=2)
    test: Count | None = optional("Paper 1's samples that are held out")


class Compared(Solid):
    paper_surface: list[Pair[Count] | None] | None = optional(
        "For each level, the paper's surface [nodes, triangles], or null"
    )


class Shape(Solid):
    """A shape that is generated: without anchors and without a bed it is free, as scenes may move it."""


class Round(Shape):
    length_m: Positive = key("Longest side [m]")
    smooth: Switch | None = optional(
        "Whether every refinement moves its new surface nodes onto the smooth shape; otherwise, the default, every "
        "level has the flat facets of the coarse one, and a cylinder 4.5 % less section than the circle's"
    )


class Cylinder(Round, Compared):
    """A round bar along z."""

    kind: Literal["cylinder"] = key("A round bar along z", "cylinder")
    radius_m: Positive = key("Radius [m]")


class Liver(Round, Compared):
    """A liver with a thick right and a thin left lobe."""

    kind: Literal["liver"] = key("A liver with a thick right and a thin left lobe", "liver")


class Kidney(Round):
    """A kidney: a bean with a hollow in its middle side."""

    kind: Literal["kidney"] = key("A bean with a hollow in its middle side", "kidney")


class Stomach(Round):
    """A filled stomach, bent like a J."""

    kind: Literal["stomach"] = key("A filled stomach, bent like a J", "stomach")


class File(Compared):
    """A body from a file: a tetrahedral mesh, or a closed surface that is filled."""

    kind: Literal["file"] = key("A tetrahedral mesh or a closed surface read from a file", "file")
    path: str = key("The mesh (.msh .vtk .vtu .vtp .mesh .stl .obj .ply .off), relative to this configuration")
    scale_m: Positive | None = optional(
        "Length [m] of one unit of the file; if left out, guessed from the size, and reported"
    )
    surface_nodes: Whole | None = optional(
        "Nodes that the coarse surface is remeshed to; a surface with as many is kept, and one with fewer if it can be "
        "filled well. Without it tetrahedra and surfaces of at most 400 nodes are kept, and others are remeshed to 140 "
        "to 360, as their shape needs",
        ge=12,
    )
    snap: Switch = key(
        "Whether the first refinement moves its new surface nodes to the file's surface, if that is remeshed; "
        "otherwise every level has the file's volume and the coarse facets",
        True,
    )


class Box(Shape):
    """A box of tetrahedra, with a corner at the origin."""

    kind: Literal["box"] = key("A box from the origin along x y and z", "box")
    sizes_m: Three[Positive] = key("Sides [m] along x, y and z")
    divisions: Three[Count] = key("Coarse cells along x, y and z, of six tetrahedra each; even numbers: symmetric")


class Sheet(_Body):
    """A flat sheet of triangles along x and y."""

    kind: Literal["sheet"] = key("A flat sheet of triangles from the origin along x and y", "sheet")
    sizes_m: Pair[Positive] = key("Sides [m] along x and y")
    divisions: Pair[Count] = key("Cells along x and y, of two triangles each; even numbers make the mesh symmetric")
    thickness_m: Positive = key("Thickness [m] of the material")
    anchors: Rule = key("Which coarse nodes are held, by exactly one rule")
    # what only solids have
    refinements: ClassVar = 0
    law: ClassVar = None
    bed: ClassVar = None
    regions: ClassVar = None
    magnitudes: ClassVar = None
    train: ClassVar = None
    test: ClassVar = None


class Ct(Compared):
    """An organ that is segmented in a CT or an MRI."""

    kind: Literal["ct"] = key("An organ in a CT or an MRI", "ct")
    modality: Literal["ct", "mri"] = key("What the image is; grey values of an MRI have no unit, and no density", "ct")
    image: Text | None = key("DICOM folder, .nii, .nii.gz, .nrrd or .mhd; null for the synthetic abdomen", None)
    mask: Text | None = key("A file that marks the organ on the image's grid; null to segment by threshold_hu", None)
    drawn_slices: Axis | None = key(
        "Axis across which only some slices of the mask are drawn; null for a whole mask", None
    )
    label: Labels | None = key(
        "Number or name of the body's label in the mask, or several; null for the only one", None
    )
    threshold_hu: Pair[Number] = key(
        "Lowest and highest CT number [HU] of the organ, without a mask; of a CT", [30, 120]
    )
    threshold: Pair[Number] | None = optional("Lowest and highest grey value of the organ, without a mask; of an MRI")
    even_brightness: Switch = key("Whether slow changes of an MRI's brightness are evened out first (N4)", False)
    crop_m: Pair[Vector] | None = optional(
        "Two opposite corners [m] of the box that is looked at, in the image's frame"
    )
    surface_nodes: Whole = key("Nodes of the coarse surface", 140, ge=12)
    snap: Switch = key("Whether the first refinement moves its new surface nodes to the CT's surface", False)
    masses: Literal["ct", "uniform"] = key(
        "What the nodes weigh: ct takes the densities of the voxels, uniform takes density_kg_m3, as an MRI always "
        "does, whose voxels have none",
        "ct",
    )


SolidBody = Cylinder | Liver | File | Box | Ct | Kidney | Stomach
Body = Annotated[
    SolidBody | Sheet,
    Field(
        discriminator="kind", description="Where the mesh comes from; file and ct are read, the others are generated"
    ),
]


def check_laws(place: str, laws: list[str], folder: Path) -> None:
    """Raise InputError for a law that is neither one of palpate's own nor a file of one, relative to ``folder``."""
    for law in laws:
        if not law.endswith(".py") and not kind_of(law):
            raise InputError(f"{place} names {describe_unknown([law], list(NAMED))}")
        if not kind_of(law):
            check_file(place, law, (folder / law).is_file())
            check_source(place, folder / law, LAW_FUNCTIONS, "see docs/add-a-law.md")


Smooth = Cylinder | Liver | Kidney | Stomach


def longest_m(body: Body | None) -> float | None:
    """Return the longest side [m] of a body; None of one whose mesh is read."""
    if isinstance(body, Box | Sheet):
        return max(body.sizes_m)
    return body.length_m if isinstance(body, Round) else None


def check_body(place: str, body: Body, folder: Path) -> None:
    """Raise InputError if settings of a body contradict each other, or name files that do not exist."""
    size, (least, most), levels = longest_m(body), POSSIBLE_M, body.refinements + 1
    if size is not None and not least <= size <= most:
        sides = "length_m" if isinstance(body, Round) else "sizes_m"
        raise InputError(
            f"{place}.{sides} makes a body {size:g} m long, and bodies are {least:g} to {most:g} m long here; give it "
            "in metres."
        )
    if isinstance(body, Shape) and body.anchors is None and body.bed is None:
        raise InputError(f"{place} lacks anchors; say what holds it, or give it a bed.")
    for name, path in body.paths(folder).items():
        # only an image may be a folder, of DICOM slices
        check_file(f"{place}.{name}", getattr(body, name), isfile(path) or (name == "image" and isdir(path)))
        if name == "law":
            check_source(f"{place}.law", Path(path), LAW_FUNCTIONS, "see docs/add-a-law.md")
    if isinstance(body, Solid):
        _check_samples(place, body)
        for name, rule in (body.regions or {}).items():
            if [rule.tag, rule.sphere, rule.label].count(None) != 2:
                raise InputError(
                    f"{place}.regions.{name} needs exactly one of tag, sphere and label; give one of them."
                )
    paper_rows = body.paper_surface if isinstance(body, Compared) else None
    if paper_rows is not None and len(paper_rows) != levels:
        raise InputError(
            f"{place}.paper_surface has {len(paper_rows)} entries; give one for each of the {levels} levels, or null."
        )
    if not isinstance(body, Ct):
        return
    if body.mask is not None and body.image is None:
        raise InputError(f"{place}.mask is given and image is not; give the image that the mask was drawn on.")
    if body.label is not None and body.mask is None:
        raise InputError(f"{place}.label is given and mask is not; give the mask that has this label.")
    low, high = body.threshold_hu
    if low >= high:
        raise InputError(f"{place}.threshold_hu is [{low:g}, {high:g}]; give the lower number first.")


def _check_samples(place: str, body: Solid) -> None:
    """Raise InputError unless whole contacts can be held out, and there is a fine mesh, of a body that is sampled."""
    sample_keys = {"magnitudes": body.magnitudes, "train": body.train, "test": body.test}
    missing = [name for name, value in sample_keys.items() if value is None]
    if 0 < len(missing) < len(sample_keys):
        raise InputError(
            f"{place} lacks {missing[0]}; give magnitudes, train and test together, "
            "or none of them for a body that only scenes use."
        )
    if body.magnitudes is None:
        return
    magnitudes = len(body.magnitudes)
    for name, count in (("train", body.train), ("test", body.test)):
        if count and count % magnitudes:
            raise InputError(
                f"{place}.{name} is {count}; make it a multiple of the {magnitudes} magnitudes, "
                "so that whole contacts can be held out."
            )
    if body.refinements < 1:
        raise InputError(
            f"{place}.refinements is 0; give at least 1, because samples compare a coarse mesh with a fine one, "
            "or leave out magnitudes, train and test."
        )
