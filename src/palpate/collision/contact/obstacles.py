"""Rigid obstacles that a body can touch, at rest or driven along a path."""

from dataclasses import dataclass

import numpy as np

from palpate.bodies.mesh_quality import LARGEST
from palpate.errors import InputError

FLOOR_HALF_WIDTH = 50.0
"""Half a floor's side, in sizes of the body, which must not fall off the edge."""


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A rigid surface with a thickness, from which bodies stay ``radius_m`` [m] away.

    points : (k, 3) [m] before it moves; triangles : (m, 3). A sphere is the triangle (0, 0, 0) of one point, a capsule
    the triangle (0, 1, 1) of two, both with a radius
    times_s : (q,) and shifts_m : (q, 3), the path: uniform motion from each position to the next, at rest before and
    after; empty if it does not move
    """

    name: str
    kind: str
    points: np.ndarray
    triangles: np.ndarray
    radius_m: float
    times_s: np.ndarray
    shifts_m: np.ndarray

    def at(self, t: float) -> np.ndarray:
        """Compute its points (k, 3) [m] at the time ``t`` [s]."""
        if not len(self.times_s):
            return self.points
        return self.points + [np.interp(t, self.times_s, self.shifts_m[:, i]) for i in range(3)]


def make_obstacle(settings: dict, place: str, name: str, size: float, middle: np.ndarray) -> Obstacle:
    """Make the obstacle of one entry of ``contact.instruments``, called ``name`` unless the entry has a name.

    kind : sphere (``center_m``, ``radius_m``), capsule (``from_m``, ``to_m``, ``radius_m``), floor (``axis``,
        ``height_m``) or mesh (``file`` with its triangles, ``scale_m``, ``radius_m``)
    times_s, shifts_m : the path, if it moves
    size [m] and middle (3,) [m] are the body's.

    Raises InputError, naming ``place``, for a path whose times do not increase or lack their shifts, and for lengths
    that are too large.
    """
    times = np.array(settings.get("times_s", []), dtype=float)
    shifts = np.array(settings.get("shifts_m", []), dtype=float).reshape(-1, 3)
    if len(times) != len(shifts) or not (np.diff(times) > 0.0).all():
        raise InputError(
            f"{place}: times_s has {len(times)} entries and shifts_m {len(shifts)}; give the same number of "
            "both, times in increasing order."
        )
    points, triangles = _SHAPES[settings["kind"]](settings, size, middle)
    name, radius = settings.get("name", name), settings.get("radius_m", 0.0)
    if not all((np.abs(lengths) <= LARGEST).all() for lengths in (points, shifts, np.array(radius))):
        raise InputError(f"{place} has a length of more than {LARGEST:g} m; give all lengths in metres.")
    return Obstacle(name, settings["kind"], points, triangles, radius, times, shifts)


def _sphere(settings: dict, size: float, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.array([settings["center_m"]], dtype=float), np.array([[0, 0, 0]])


def _capsule(settings: dict, size: float, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.array([settings["from_m"], settings["to_m"]], dtype=float), np.array([[0, 1, 1]])


def _floor(settings: dict, size: float, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Make one triangle, wide enough."""
    up = "xyz".index(settings.get("axis", "z"))
    corners = np.array([[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]]) * FLOOR_HALF_WIDTH * size
    points = np.insert(corners + np.delete(middle, up), up, settings["height_m"], axis=1)
    return points, np.array([[0, 1, 2]]) if up != 1 else np.array([[0, 2, 1]])


def _mesh(settings: dict, size: float, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    from palpate.bodies.mesh_file import load_surface

    return load_surface(settings["file"], settings.get("scale_m", 1.0))


_SHAPES = {"sphere": _sphere, "capsule": _capsule, "floor": _floor, "mesh": _mesh}
