"""A rigid instrument: its signed distance with two derivatives, and the place at which it first touches a body.

Contact at rest is an augmented Lagrangian (Alart and Curnier 1991; Simo and Laursen 1992) in ``solvers.indentation``: a
point of the surface at the gap g has the pressure max(λ − k g, 0), and the multiplier λ is set to that pressure again
and again until nothing overlaps. There is no tension, and no friction unless points stick, which then keep their place
on the instrument while they are pressed.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numba
import numpy as np

from palpate.bodies.mesh import Mesh
from palpate.errors import InputError

SPHERE, CAPSULE, PUNCH, GRASP = "sphere", "capsule", "punch", "grasp"
KINDS = (SPHERE, CAPSULE, PUNCH, GRASP)


@dataclass(frozen=True, eq=False)
class Instrument:
    """A rigid body that is pushed into tissue, or a grasper that moves a patch of its surface.

    kind : a sphere; a capsule, that lies on its side; a punch, a cylinder with a flat end; or a grasp, which holds a
        patch of the surface and has no shape and no gaps
    radius_m : of the sphere, the capsule, the cylinder or the patch [m]
    edge_m : radius of the punch's rounded edge, at most that of the cylinder [m]
    length_m : of the capsule between the centres of its ends [m]
    sticks : whether points that touch keep their place on it, or slide without friction
    InputError for an unknown kind, and for lengths that are negative, not finite or too large.
    """

    kind: str
    radius_m: float
    edge_m: float = 0.0
    length_m: float = 0.0
    sticks: bool = False

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"instrument: kind is {self.kind}; take one of {', '.join(KINDS)}.")
        if not (np.isfinite(self.radius_m) and self.radius_m > 0.0):
            raise InputError(f"instrument: radius_m is {self.radius_m}; give a positive length [m].")
        if not 0.0 <= self.edge_m <= self.radius_m:
            raise InputError(f"instrument: edge_m is {self.edge_m}; give 0 to {self.radius_m:g} m, its radius_m.")
        if not 0.0 <= self.length_m < np.inf:
            raise InputError(f"instrument: length_m is {self.length_m}; give a length [m] of 0 or more.")

    @cached_property
    def shape(self) -> np.ndarray:
        """The arguments of kernels, (4,): number of the kind, radius, edge and half the length [m]."""
        return np.array([KINDS.index(self.kind), self.radius_m, self.edge_m, 0.5 * self.length_m])

    @property
    def name(self) -> str:
        """Its name in tables."""
        return f"{self.kind} {1e3 * self.radius_m:g} mm"


@dataclass(frozen=True, eq=False)
class Pose:
    """Where an instrument is.

    tip : (3,) [m], its lowest point; axes : (3, 3), rows: along a capsule, across, and from the tip into the instrument
    """

    instrument: Instrument
    tip: np.ndarray
    axes: np.ndarray

    def moved(self, displacement: np.ndarray) -> "Pose":
        """Return the pose displaced by ``displacement`` (3,) [m]."""
        return replace(self, tip=self.tip + displacement)

    def gaps(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distance (n,) [m] of ``points`` (n, 3) [m], negative inside, and its gradient (n, 3)."""
        gaps, normals = np.empty(len(points)), np.empty((len(points), 3))
        distances(points, self.tip, self.axes, self.instrument.shape, gaps, normals)
        return gaps, normals

    def bends(self, points: np.ndarray, gaps: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return the second derivatives (n, 3, 3) [1/m] of the distance; gaps, normals : as ``gaps`` returns them."""
        second = np.empty((len(points), 3, 3))
        curvatures(points, self.tip, self.axes, self.instrument.shape, gaps, normals, second)
        return second


def upright(instrument: Instrument, tip: np.ndarray, outward: np.ndarray) -> Pose:
    """Return the pose of an instrument whose ``tip`` (3,) [m] points against ``outward`` (3,)."""
    up = outward / np.linalg.norm(outward)
    along = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    along /= np.linalg.norm(along)
    return Pose(instrument, np.asarray(tip, dtype=float), np.array([along, np.cross(up, along), up]))


@numba.njit(cache=True, error_model="numpy")
def distances(points, tip, axes, shape, gaps, normals):
    """Write the signed distances (n,) [m] of ``points`` (n, 3) from an instrument, and their gradients (n, 3).

    A sphere is a capsule of no length. A punch is the set of points within ``edge`` of a cylinder of radius − edge that
    has no upper end; inside that cylinder the nearer of its end and its side counts.
    """
    kind, radius, edge, half = shape
    for n in range(len(points)):
        dx, dy, dz = points[n, 0] - tip[0], points[n, 1] - tip[1], points[n, 2] - tip[2]
        x = axes[0, 0] * dx + axes[0, 1] * dy + axes[0, 2] * dz
        y = axes[1, 0] * dx + axes[1, 1] * dy + axes[1, 2] * dz
        z = axes[2, 0] * dx + axes[2, 1] * dy + axes[2, 2] * dz
        if kind == 2:
            rho = np.sqrt(x * x + y * y)
            outside, below = rho - (radius - edge), edge - z
            if outside > 0.0 and below > 0.0:
                away = np.sqrt(outside * outside + below * below)
                side, down = outside / away, below / away
            elif outside > below:
                away, side, down = outside, 1.0, 0.0
            else:
                away, side, down = below, 0.0, 1.0
            gaps[n] = away - edge
            safe = max(rho, 1e-300)
            x, y, z = side * x / safe, side * y / safe, -down
        else:
            x -= min(max(x, -half), half)
            z -= radius
            away = max(np.sqrt(x * x + y * y + z * z), 1e-300)
            gaps[n] = away - radius
            x, y, z = x / away, y / away, z / away
        for i in range(3):
            normals[n, i] = axes[0, i] * x + axes[1, i] * y + axes[2, i] * z


class Tools(NamedTuple):
    """The poses and shapes of k instruments for kernels: tips (k, 3) [m], axes (k, 3, 3), shapes (k, 4)."""

    tips: np.ndarray
    axes: np.ndarray
    shapes: np.ndarray

    @property
    def radii(self) -> np.ndarray:
        """Their radii (k,) [m]."""
        return self.shapes[:, 1]


@numba.njit(cache=True, error_model="numpy")
def gaps_of(points, tools):
    """Return the distances (k, q) [m] of ``points`` (q, 3) [m] from ``tools``, and their gradients (k, q, 3)."""
    tips, axes, shapes = tools
    gaps, normals = np.empty((len(tips), len(points))), np.empty((len(tips), len(points), 3))
    for k in range(len(tips)):
        distances(points, tips[k], axes[k], shapes[k], gaps[k], normals[k])
    return gaps, normals


@numba.njit(cache=True, error_model="numpy")
def curvatures(points, tip, axes, shape, gaps, normals, bends):
    """Write the second derivatives (n, 3, 3) [1/m] of the distances; gaps, normals : those of ``distances``."""
    kind, radius, edge, half = shape
    around_axis, around_edge = np.empty(3), np.empty(3)
    for n in range(len(points)):
        x = y = z = 0.0
        for i in range(3):
            x += axes[0, i] * (points[n, i] - tip[i])
            y += axes[1, i] * (points[n, i] - tip[i])
            z += axes[2, i] * (points[n, i] - tip[i])
        bends[n] = 0.0
        away = gaps[n] + (edge if kind == 2 else radius)
        if kind != 2:
            straight = -half < x < half  # a straight part bends one way only
            for i in range(3):
                for j in range(3):
                    flat = (1.0 if i == j else 0.0) - normals[n, i] * normals[n, j]
                    bends[n, i, j] = (flat - (axes[0, i] * axes[0, j] if straight else 0.0)) / max(away, 1e-300)
            continue
        rho = np.sqrt(x * x + y * y)
        out, below = rho - (radius - edge), edge - z
        edged = out > 0.0 and below > 0.0
        if rho == 0.0 or not (edged or out > below):
            continue
        side = out / away if edged else 1.0
        down = below / away if edged else 0.0
        for i in range(3):
            radial = (axes[0, i] * x + axes[1, i] * y) / rho
            around_axis[i] = (axes[1, i] * x - axes[0, i] * y) / rho  # around the axis
            around_edge[i] = down * radial + side * axes[2, i]  # around the edge
        for i in range(3):
            for j in range(3):
                bends[n, i, j] = side / rho * around_axis[i] * around_axis[j]
                if edged:
                    bends[n, i, j] += around_edge[i] * around_edge[j] / away


ZOOMS, ZOOM = 42, 0.7
"""How often the grid of the search for the least gap in a triangle is refined, and its size over the last one: not so
small that the minimum of a narrow valley, as under a capsule, could be outside."""
TOUCHES, TOUCH_TOLERANCE = 60, 1e-9
"""Most steps of the instrument to first touch, and the gap there, over its radius."""
_GRID = np.array([[i, j, 6 - i - j] for i in range(7) for j in range(7 - i)]) / 6.0


def first_touch(pose: Pose, mesh: Mesh, direction: np.ndarray) -> Pose:
    """Return ``pose`` moved along the unit vector ``direction`` (3,) to where it first touches the surface of ``mesh``.

    The distance from a convex instrument is convex on a triangle, so that grids which are refined around their least
    value find the minimum. InputError where the instrument misses the body.
    """
    unit = np.asarray(direction, dtype=float)
    corners, radius = mesh.nodes[mesh.triangles], pose.instrument.radius_m
    pose = pose.moved(-(2.0 * (mesh.size + radius) + pose.instrument.length_m) * unit)
    step = 0.0
    for _ in range(TOUCHES):
        gap, closing = _least_gap(pose, corners, unit)
        if abs(gap) <= TOUCH_TOLERANCE * radius:
            return pose
        if gap < 0.0:  # another triangle came first
            step *= 0.5
            pose = pose.moved(-step * unit)
            continue
        if closing <= 0.0:
            break
        # not past the surface, as a gap does not shrink faster than one moves; Newton's steps where it is small
        step = gap if gap > 1e-2 * radius else min(gap / closing, 0.1 * radius)
        pose = pose.moved(step * unit)
    raise InputError("the instrument does not reach the body along its direction; choose another place or direction.")


def _least_gap(pose: Pose, corners: np.ndarray, direction: np.ndarray) -> tuple[float, float]:
    """Return the least gap [m] to triangles (m, 3, 3) [m], and its decrease per metre of motion along ``direction``."""
    centroids = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centroids[:, None], axis=2).max(axis=1)
    gaps, _ = pose.gaps(centroids)
    near = np.flatnonzero(gaps - reach <= gaps.min())  # those in which a smaller gap is possible
    corners, reach = corners[near], reach[near]
    points = np.einsum("ga,mai->mgi", _GRID, corners)
    gaps = pose.gaps(points.reshape(-1, 3))[0].reshape(len(corners), -1)
    near = np.flatnonzero(gaps.min(axis=1) - reach / 3.0 <= gaps.min())
    best, scale, facets, reach = _GRID[gaps[near].argmin(axis=1)], 1.0, corners[near], reach[near]
    for _ in range(ZOOMS):  # refine the grid around the best point of each triangle
        scale *= ZOOM
        grids = np.clip(best[:, None] + scale * (_GRID - 1.0 / 3.0), 0.0, None)
        grids = np.concatenate([best[:, None], grids / grids.sum(axis=2, keepdims=True)], axis=1)
        points = np.einsum("mga,mai->mgi", grids, facets).reshape(-1, 3)
        gaps, normals = pose.gaps(points)
        by_triangle = gaps.reshape(len(facets), -1)
        # those in which a smaller gap is within reach of this grid and all later ones
        near = np.flatnonzero(by_triangle.min(axis=1) - scale / (1.0 - ZOOM) * reach <= gaps.min())
        best, facets, reach = grids[near, by_triangle[near].argmin(axis=1)], facets[near], reach[near]
    least = int(gaps.argmin())
    return float(gaps[least]), float(normals[least] @ direction)
