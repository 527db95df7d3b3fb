"""Elastic bed: a part of a body's surface on springs, as ligaments and fat hold an organ."""

import math
from dataclasses import dataclass, replace

import numpy as np

from palpate.bodies.mesh import Mesh
from palpate.errors import InputError

FACING = 0.5
"""Cosine of the largest angle, 60°, between ``facing`` and the normal of a triangle with springs."""


@dataclass(frozen=True, eq=False)
class Bed:
    """Springs under the surface in a sphere, that resist displacement in each direction.

    center_m : (3,) [m]; radius_m : [m]
    stiffness_n_m3 : traction per displacement at the centre [N/m³], which fades to zero at the sphere
    facing : (3,) unit vector; only triangles whose outward normal is within 60° of it have springs, None for all
    """

    center_m: np.ndarray
    radius_m: float
    stiffness_n_m3: float
    facing: np.ndarray | None = None

    def moved(self, shift: np.ndarray) -> "Bed":
        """Return the bed of a body that is moved by ``shift`` (3,) [m]."""
        return replace(self, center_m=self.center_m + shift)

    def faces(self, nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        """Mark those of ``triangles`` (m, 3) on ``nodes`` (n, 3) [m] that face as the bed asks, (m,) bool."""
        if self.facing is None:
            return np.ones(len(triangles), dtype=bool)
        a, b, c = (nodes[triangles[:, i]] for i in range(3))
        normals = np.cross(b - a, c - a)
        return normals @ self.facing >= FACING * np.linalg.norm(normals, axis=1)


def read_bed(body: str, rule: dict, mesh: Mesh) -> Bed:
    """Read ``{sphere: {center_m, radius_m}, stiffness_n_m3}`` and perhaps ``facing: [x, y, z]``.

    InputError unless it is positive, faces somewhere and meets the body.
    """
    sphere, stiffness = rule["sphere"], float(rule["stiffness_n_m3"])
    facing = None if "facing" not in rule else np.array(rule["facing"], dtype=float)
    if facing is not None:
        if not np.any(facing):
            raise InputError(f"body {body}: bed.facing is [0, 0, 0]; give the direction that the bed's side faces.")
        facing = facing / np.linalg.norm(facing)
    bed = Bed(np.array(sphere["center_m"], dtype=float), float(sphere["radius_m"]), stiffness, facing)
    for key, value in (("radius_m", bed.radius_m), ("stiffness_n_m3", stiffness)):
        if not (value > 0 and math.isfinite(value)):
            raise InputError(f"body {body}: bed has {key} {value:g}; give a positive number.")
    inside = inner_nodes(mesh, bed)
    if len(inside) < 3:
        raise InputError(
            f"body {body}: bed.sphere holds {len(inside)} nodes of the coarse surface; move or enlarge it so that at "
            "least 3 lie in it, or change facing."
        )
    if len(inside) == len(mesh.surface):
        raise InputError(
            f"body {body}: bed.sphere holds the whole surface, so nothing can be pressed; make it smaller."
        )
    return bed


def inner_nodes(mesh: Mesh, bed: Bed) -> np.ndarray:
    """Return the surface nodes in the sphere of ``bed``, and of the triangles that face as it asks, increasing."""
    nodes = np.unique(mesh.triangles[bed.faces(mesh.nodes, mesh.triangles)])
    distance = np.linalg.norm(mesh.nodes[nodes] - bed.center_m, axis=1)
    return nodes[distance < bed.radius_m]
