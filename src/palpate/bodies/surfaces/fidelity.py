"""Closeness of a body to the surface it was made from, and the shapes of its elements."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import LEAST_DEG, dihedral_angles
from palpate.bodies.refinement import refine
from palpate.bodies.surfaces.mend import Mended
from palpate.bodies.surfaces.samples import distances, sample
from palpate.bodies.surfaces.solid import Solid

# the fine level that bodies usually have, on which their shape is judged
LEVEL = 2
MOST_AWAY, MOST_VOLUME = 0.01, 0.02


@dataclass(frozen=True)
class Fidelity:
    """Smallest dihedral angle on any level [°]; on level 2, greatest distance between the surfaces, either way, over
    the size, and volume over the solid's, minus 1."""

    least_deg: float
    away: float
    volume: float
    size_m: float

    @property
    def good(self) -> bool:
        """Return true if shape and elements are as good as a body should be."""
        return self.penalty <= 1

    @property
    def close(self) -> bool:
        """Return true if the body has the shape of the surface it was made from."""
        return max(self.away / MOST_AWAY, abs(self.volume) / MOST_VOLUME) <= 1

    @property
    def penalty(self) -> float:
        """Worst of the three, 1 where just good enough."""
        return max(LEAST_DEG / max(self.least_deg, 1e-3), self.away / MOST_AWAY, abs(self.volume) / MOST_VOLUME)


def fidelity(mesh: TetMesh, snap: Callable[[TetMesh, int], TetMesh] | None, solid: Solid, mended: Mended) -> Fidelity:
    """Refine and snap a coarse mesh as a body is, and compare it with the surface it was made from."""
    least = float(dihedral_angles(mesh).min())
    for _ in range(LEVEL):
        finer, _ = refine(mesh)
        mesh = finer if snap is None else snap(finer, len(mesh.nodes))
        least = min(least, float(dihedral_angles(mesh).min()))
    size = float(np.ptp(solid.places, axis=0).max())
    ours = sample(mesh.nodes, mesh.triangles, size / 100)[0]
    away = max(
        distances(solid.places, mesh.nodes, mesh.triangles).max(),
        distances(ours, mended.points, mended.triangles).max(),
    )
    volume = (solid.mask.sum() - sum(hollow.sum() for hollow in solid.hollows)) * solid.voxel_m3
    return Fidelity(least, float(away) / size, float(mesh.volumes.sum() / volume - 1), size)
