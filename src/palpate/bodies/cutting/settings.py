"""Settings of cuts, of a body at rest or made while it moves."""

from typing import Literal

from palpate.setting_types import Block, NotNegative, Positive, Vector, key, optional


class DiscSettings(Block):
    center_m: Vector = key("Centre [m]")
    normal: Vector = key("Direction of the normal")
    radius_m: Positive = key("Radius [m]")


class PlaneSettings(Block):
    point_m: Vector = key("A point of the plane [m]")
    normal: Vector = key("Direction of the normal")


class CutSettings(Block):
    """A cut of a body at rest, by exactly one of path_m with depth_m, disc and plane."""

    path_m: list[Vector] | None = optional("Points [m] on the skin that the blade is moved along", min_length=1)
    depth_m: NotNegative | None = optional("Greatest depth [m] of the blade below its path; 0 severs nothing")
    direction: Vector | None = optional("Where the blade points; by default into the body")
    disc: DiscSettings | None = optional("A flat round cut, inside the body or not")
    plane: PlaneSettings | None = optional("A flat cut through the whole body")


class Stroke(CutSettings):
    """A cut of the body at rest that is made in time, by exactly one of path_m with depth_m, disc and plane."""

    at_s: NotNegative = key("When the blade starts [s]", 0)
    lasts_s: NotNegative = key("How long it takes along its path [s]; 0 cuts all at once", 0)


class Cut(Stroke):
    """A cut through a body at rest, by a blade along a path, a disc or a plane."""

    way: Literal["conform", "split_faces", "virtual_nodes"] = key(
        "The mesh is made anew so that it conforms to the cut, or cut along its faces, or its elements are doubled",
        "conform",
    )
    more: list[Stroke] | None = optional("Further cuts of the same body, which may cross", min_length=1)
