"""Sides of a body that may hold it, in words of a person and as an axis and its end."""

_OF_MESH = {
    "below": ("z", "min"),
    "above": ("z", "max"),
    "left": ("x", "min"),
    "right": ("x", "max"),
    "front": ("y", "min"),
    "back": ("y", "max"),
}
"""In a mesh z points up, and x to the right of whoever looks at its front."""
# of a patient in an image: x points to the left hand, y to the back, z to the head
_OF_IMAGE = _OF_MESH | {"left": ("x", "max"), "right": ("x", "min")}
_BY_AXIS = {f"{axis}-{side}": (axis, side) for axis in "xyz" for side in ("min", "max")}

HOLDS = (*_OF_MESH, *_BY_AXIS)
"""The words that name a side."""


def sides_of(kind: str, hold: str | None) -> list[tuple[str, str]]:
    """Return the sides, as axis and end, that may hold a body: the one that is named, or all that suit its kind.

    kind : of the body's entry; "ct" is a patient, who lies on the back
    """
    if hold is not None:
        return [(_BY_AXIS | (_OF_IMAGE if kind == "ct" else _OF_MESH))[hold]]
    return [_OF_IMAGE["back"]] if kind == "ct" else list(_BY_AXIS.values())
