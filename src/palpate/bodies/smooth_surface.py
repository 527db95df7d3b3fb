"""Smooth surface of a body that has one: what it is, and how the nodes of finer meshes are moved onto it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING

from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import REFUSED_DEG
from palpate.bodies.surfaces.snap import element_quality
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.bodies.organs import Shape
    from palpate.bodies.surfaces.snap import Onto

ORGANS = ("liver", "kidney", "stomach")
"""Kinds of bodies whose surface is an image of the sphere."""


@dataclass(frozen=True)
class SmoothSurface:
    """The smooth surface of a body.

    kind : cylinder, or one of ORGANS
    size_m : the organ's longest side, or the cylinder's radius [m], whose flat ends need no size
    """

    kind: str
    size_m: float

    def snap(self, mesh: TetMesh, first: int) -> TetMesh:
        """Return ``mesh`` with its surface nodes from number ``first`` on moved onto the surface.

        Nodes inside follow where elements would be bad. InputError if elements are bad all the same.
        """
        snapped = _snapper(self)(mesh, first)
        least = float(element_quality(snapped.nodes, snapped.tetrahedra).min())
        if not least >= REFUSED_DEG:
            raise InputError(
                f"bodies: a {self.kind} whose refined surface is smooth has elements with dihedral angles of "
                f"{least:.2g}°; give smooth: false."
            )
        return snapped


def surface_of(entry: dict) -> SmoothSurface | None:
    """Return the smooth surface of a body's entry in the config, whether its levels lie on it or not; None without."""
    kind = entry["kind"]
    if kind in ORGANS:
        return SmoothSurface(kind, float(entry["length_m"]))
    return SmoothSurface(kind, float(entry["radius_m"])) if kind == "cylinder" else None


def organ_shape(kind: str) -> "Shape":
    """Return the map of the unit sphere to the organ ``kind``, one of ORGANS."""
    from palpate.bodies import organs

    shapes: dict[str, Shape] = {"liver": organs.liver_shape, "kidney": organs.kidney_shape}
    return (shapes | {"stomach": organs.stomach_shape})[kind]


@lru_cache(maxsize=8)
def _snapper(surface: SmoothSurface) -> Callable[[TetMesh, int], TetMesh]:
    from palpate.bodies.box import onto_cylinder
    from palpate.bodies.organs import onto_shape
    from palpate.bodies.surfaces.snap import snapper_onto

    onto: Onto
    if surface.kind == "cylinder":
        onto = partial(onto_cylinder, radius_m=surface.size_m)
    else:
        onto = onto_shape(organ_shape(surface.kind), surface.size_m)
    return snapper_onto(onto)
