"""How like a mesh is to the mesh file or the CT that it was made from."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.bodies.body_from_mesh import solid_of
from palpate.bodies.ct.mesh_from_ct import segment_entry
from palpate.bodies.mesh import TetMesh
from palpate.bodies.surfaces.mask_surface import dense_surface
from palpate.bodies.surfaces.remeshed import MOST_AWAY, MOST_VOLUME, apart


@dataclass(frozen=True)
class Likeness:
    """Greatest distance [m] between two surfaces, either way; its share of the size; both volumes [m³]."""

    away_m: float
    away: float
    volume_m3: float
    data_m3: float

    @property
    def volume(self) -> float:
        """The mesh's volume over the data's, minus 1."""
        return self.volume_m3 / self.data_m3 - 1.0

    @property
    def penalty(self) -> float:
        """The worse of both, 1 where just good enough."""
        return max(self.away / MOST_AWAY, abs(self.volume) / MOST_VOLUME)

    @property
    def close(self) -> bool:
        """Return whether the mesh has the shape of the data."""
        return self.penalty <= 1.0


def likeness(mesh: TetMesh, entry: dict) -> Likeness:
    """Compare ``mesh`` with the surface and the volume of what a config entry of kind file or ct was made from."""
    places, points, triangles, volume_m3 = _surface(entry)
    away_m = apart(mesh, places, points, triangles)
    return Likeness(away_m, away_m / float(np.ptp(places, axis=0).max()), float(mesh.volumes.sum()), volume_m3)


def _surface(entry: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return places (k, 3) [m] on the data's surface, its points and triangles, and the volume in it [m³]."""
    if entry["kind"] == "file":
        mended, solid = solid_of(Path(entry["path"]), entry["scale_m"])
        return solid.places, mended.points, mended.triangles, solid.volume_m3
    image, mask = segment_entry(entry)
    points, triangles = dense_surface(mask, image)
    return points, points, triangles, float(mask.sum() * image.voxel_m3)
