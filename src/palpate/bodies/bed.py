"""Elastic bed: a part of a body's surface on springs, as ligaments and fat hold an organ."""

import math
from dataclasses import dataclass, replace

import numpy as np

from palpate.bodies.mesh import Mesh
from palpate.errors import InputError


@dataclass(frozen=True, eq=False)
class Bed:
    """Springs under the surface in a sphere, that resist displacement in each direction.

    center_m : (3,) [m]; radius_m : [m]
    stiffness_n_m3 : traction per displacement at the centre [N/m³], which fades to zero at the sphere
    """

    center_m: np.ndarray
    radius_m: float
    stiffness_n_m3: float

    def moved(self, shift: np.ndarray) -> "Bed":
        """Return the bed of a body that is moved by ``shift`` (3,) [m]."""
        return replace(self, center_m=self.center_m + shift)


def read_bed(body: str, rule: dict, mesh: Mesh) -> Bed:
    """Read ``{sphere: {center_m, radius_m}, stiffness_n_m3}``; InputError unless it is positive and meets the body."""
    sphere, stiffness = rule["sphere"], float(rule["stiffness_n_m3"])
    bed = Bed(np.array(sphere["center_m"], dtype=float), float(sphere["radius_m"]), stiffness)
    for key, value in (("radius_m", bed.radius_m), ("stiffness_n_m3", stiffness)):
        if not (value > 0 and math.isfinite(value)):
            raise InputError(f"body {body}: bed has {key} {value:g}; give a positive number.")
    inside = inner_nodes(mesh, bed)
    if len(inside) < 3:
        raise InputError(
            f"body {body}: bed.sphere holds {len(inside)} nodes of the coarse surface; move or enlarge it so that at "
            "least 3 lie in it."
        )
    if len(inside) == len(mesh.surface):
        raise InputError(
            f"body {body}: bed.sphere holds the whole surface, so nothing can be pressed; make it smaller."
        )
    return bed


def inner_nodes(mesh: Mesh, bed: Bed) -> np.ndarray:
    """Return the surface nodes in the sphere of ``bed``, increasing."""
    distance = np.linalg.norm(mesh.nodes[mesh.surface] - bed.center_m, axis=1)
    return mesh.surface[distance < bed.radius_m]
