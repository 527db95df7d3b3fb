"""Cuts by a disc, a plane or a blade: a surface in the body at rest, and the patch of it that is severed."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple, Protocol

import numpy as np

from palpate.bodies.cutting.settings import CutSettings, DiscSettings
from palpate.bodies.mesh import Mesh, area_normals, unit, winding_number
from palpate.errors import InputError


class Piece(NamedTuple):
    """A flat piece of a cut, with the functions ``across`` and ``within`` of ``Cut``.

    Its front includes the lines where it meets other pieces.
    point : (3,) [m] of its plane; normal : (3,) unit vector, to the positive side
    within : from points (n, 3) [m] to (n,) [m]
    """

    point: np.ndarray
    normal: np.ndarray
    within: Callable[[np.ndarray], np.ndarray]

    def across(self, points: np.ndarray) -> np.ndarray:
        return (points - self.point) @ self.normal


class Cut(Protocol):
    """A surface without borders, and the patch of it that is severed.

    The surface is where ``across`` is 0. On it the patch is where ``within`` is positive, its front where it is 0.
    """

    @property
    def pieces(self) -> list[Piece]:
        """The flat pieces that the patch consists of; none where it has no area."""

    def across(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance (n,) [m] of ``points`` (n, 3) [m] from the surface."""

    def within(self, points: np.ndarray) -> np.ndarray:
        """Return how far (n,) [m] the feet of ``points`` (n, 3) [m] on the surface are inside the patch.

        Zero exactly at the front, and near it a distance to first order.
        """

    def severs(self, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return which segments (n,) bool from ``first`` to ``last``, both (n, 3) [m], cross the patch.

        An end on the surface counts as lying on its positive side, so that of two segments which meet there one is
        severed at most.
        """
        severed = np.zeros(len(first), dtype=bool)
        for piece in self.pieces:
            first_side, last_side = piece.across(first), piece.across(last)
            crosses = (first_side >= 0.0) != (last_side >= 0.0)
            crossing = np.divide(first_side, first_side - last_side, out=np.zeros_like(first_side), where=crosses)
            severed |= crosses & (piece.within(first + crossing[:, None] * (last - first)) > 0.0)
        return severed

    @property
    def narrow_m(self) -> float:
        """The smaller half width of the patch [m]."""

    def patch(self, spacing_m: float) -> np.ndarray:
        """Return points (n, 3) [m] of the patch, none of which is farther than ``spacing_m`` from its neighbours."""

    def front(self, spacing_m: float) -> np.ndarray:
        """Return points (n, 3) [m] of the patch's front in the same way."""


def _sides(normal: np.ndarray) -> np.ndarray:
    """Return two unit vectors (2, 3) that make a right-handed frame with the unit vector ``normal`` (3,), third."""
    tangent = unit(np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))]))
    return np.array([tangent, np.cross(normal, tangent)])


@dataclass(frozen=True, eq=False)
class Disc(Cut):
    """A flat round cut: of a penny inside a body, or of all of it where the radius is large.

    center_m : (3,) [m]; normal : (3,) unit vector, to the positive side; radius_m : [m], 0 severs nothing
    """

    center_m: np.ndarray
    normal: np.ndarray
    radius_m: float

    @property
    def pieces(self) -> list[Piece]:
        return [Piece(self.center_m, self.normal, self.within)] if self.radius_m > 0.0 else []

    def across(self, points: np.ndarray) -> np.ndarray:
        return (points - self.center_m) @ self.normal

    def within(self, points: np.ndarray) -> np.ndarray:
        from_center = points - self.center_m
        return self.radius_m - np.linalg.norm(from_center - np.outer(from_center @ self.normal, self.normal), axis=1)

    @property
    def narrow_m(self) -> float:
        return self.radius_m

    def patch(self, spacing_m: float) -> np.ndarray:
        line = np.arange(-self.radius_m, self.radius_m + spacing_m, spacing_m)
        grid = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        inside = grid[np.linalg.norm(grid, axis=1) < self.radius_m]
        return np.vstack([self.center_m + inside @ _sides(self.normal), self.front(spacing_m)])

    def front(self, spacing_m: float) -> np.ndarray:
        count = max(8, int(np.ceil(2.0 * np.pi * self.radius_m / spacing_m)))
        angle = 2.0 * np.pi * np.arange(count) / count
        circle = self.radius_m * np.column_stack([np.cos(angle), np.sin(angle)])
        return self.center_m + circle @ _sides(self.normal)


@dataclass(frozen=True, eq=False)
class Blade(Cut):
    """The cut of a blade that is moved along a path: all within a depth below the path, and as far above it.

    path_m : (k, 2 or more points, 3) [m] of straight pieces; direction : (3,) unit vector, where the blade points
    depth_m : the greatest; 0 severs nothing
    open_ends : whether the blade leaves the body at the first and the last point. At an end where it does not, the
        depth falls to zero as an ellipse does; the surface goes on beyond both, straight and parallel to the pieces
    reached_m : length of the path, along the surface, that the blade has gone so far
    """

    path_m: np.ndarray
    direction: np.ndarray
    depth_m: float
    open_ends: tuple[bool, bool] = (False, False)
    reached_m: float = np.inf
    _flat: np.ndarray = field(init=False)
    _starts: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        along = np.diff(self.path_m, axis=0)
        along -= np.outer(along @ self.direction, self.direction)
        lengths = np.linalg.norm(along, axis=1)
        if not (lengths > 1e-9 * np.linalg.norm(np.ptp(self.path_m, axis=0))).all():
            raise InputError("a cut's path_m has a piece that the blade points along; give another path or direction.")
        object.__setattr__(self, "_flat", along / lengths[:, None])
        object.__setattr__(self, "_starts", np.append(0.0, np.cumsum(lengths)))

    @property
    def length_m(self) -> float:
        """Length of the path along the surface [m]."""
        return float(self._starts[-1])

    @property
    def _normals(self) -> np.ndarray:
        return np.cross(self._flat, self.direction)

    @property
    def pieces(self) -> list[Piece]:
        each = enumerate(zip(self.path_m, self._normals, strict=False)) if self.depth_m > 0.0 else ()
        return [Piece(point, normal, partial(self._within_piece, piece=i)) for i, (point, normal) in each]

    def share(self, points: np.ndarray) -> np.ndarray:
        """Return the part (n,) of the path, 0 to 1, that the blade has gone when nearest to ``points`` (n, 3) [m]."""
        return np.clip(self._place(points)[1] / self.length_m, 0.0, 1.0)

    def up_to(self, reached_m: float) -> "Blade":
        """Return the cut when the blade has gone ``reached_m`` [m] of its path and stands still in it."""
        return replace(self, reached_m=float(reached_m))

    def across(self, points: np.ndarray) -> np.ndarray:
        return self._place(points)[0]

    def within(self, points: np.ndarray) -> np.ndarray:
        _, along, below = self._place(points)
        return self._inside(along, below)

    def _within_piece(self, points: np.ndarray, piece: int) -> np.ndarray:
        along, below = self._on_piece(points, piece)
        begin, end = self._range(piece)
        return np.min([self._inside(along, below), along - begin, end - along], axis=0)

    @property
    def narrow_m(self) -> float:
        return min(self.depth_m, 0.5 * min(self.length_m, self.reached_m))

    def patch(self, spacing_m: float) -> np.ndarray:
        reached = min(self.reached_m, self.length_m)
        along = np.linspace(0.0, reached, 1 + int(np.ceil(reached / spacing_m)))
        rows = [
            self.at(np.full(_count(depth, spacing_m), place), np.linspace(0.0, depth, _count(depth, spacing_m)))
            for place, depth in zip(along, self._depth(along), strict=True)
        ]
        return np.vstack([*rows, self.front(spacing_m)])

    def front(self, spacing_m: float) -> np.ndarray:
        """Return points (n, 3) [m] along the lower edge, and down the blade where it now stands, if it is under way."""
        middle, semi_axis = self._ellipse()
        count = _count(0.5 * np.pi * (self.length_m + 2.0 * self.depth_m), spacing_m)
        # at an end that tapers the front is steep: places are even in the ellipse's angle
        angle = 0.5 * np.pi * np.linspace(-1.0 + self.open_ends[0], 1.0 - self.open_ends[1], count)
        along = np.linspace(0.0, self.length_m, count) if semi_axis == np.inf else middle + semi_axis * np.sin(angle)
        if self.reached_m < self.length_m:
            depth = float(self._depth(np.array([self.reached_m]))[0])
            blade = np.full(_count(depth, spacing_m), self.reached_m), np.linspace(0.0, depth, _count(depth, spacing_m))
            along = along[along < self.reached_m]
            return np.vstack([self.at(along, self._depth(along)), self.at(*blade)])
        return self.at(along, self._depth(along))

    def _ellipse(self) -> tuple[float, float]:
        """Return the middle and the semi-axis [m], along the path, of the ellipse of depths; inf with two open ends."""
        open_start, open_end = self.open_ends
        if open_start and open_end:
            return 0.5 * self.length_m, np.inf
        semi_axis = self.length_m / (1.0 if open_start or open_end else 2.0)
        return (0.0 if open_start else self.length_m if open_end else semi_axis), semi_axis

    def _depth(self, along: np.ndarray) -> np.ndarray:
        """Return the blade's depth (n,) [m] at places ``along`` (n,) [m] the path."""
        middle, half = self._ellipse()
        return self.depth_m * np.sqrt(np.clip(1.0 - self._off_middle(along, middle, half) ** 2, 0.0, None))

    def _off_middle(self, along: np.ndarray, middle: float, half: float) -> np.ndarray:
        """Return places ``along`` (n,) [m] from the ellipse's middle over its semi-axis; 0 towards an open end."""
        open_start, open_end = self.open_ends
        return np.clip((along - middle) / half, 0.0 if open_start else None, 0.0 if open_end else None)

    def _inside(self, along: np.ndarray, below: np.ndarray) -> np.ndarray:
        """Return ``within`` (n,) [m] of points at places (n,) [m] along the path and below it.

        With f² = along_ratio² + below_ratio², 1 on the ellipse, it is (1 - f) / ‖∇f‖, a distance to first order.
        """
        if self.depth_m == 0.0:
            return np.full(len(along), -np.inf)
        middle, half = self._ellipse()
        along_ratio, below_ratio = self._off_middle(along, middle, half), np.maximum(below, 0.0) / self.depth_m
        f = np.hypot(along_ratio, below_ratio)
        slope = np.hypot(along_ratio / half, below_ratio / self.depth_m)  # ‖∇f‖ times f
        shorter_axis = min(half, self.depth_m)
        inside = np.where(f > 0.0, (1.0 - f) * f / np.where(f > 0.0, slope, 1.0), shorter_axis)
        return np.minimum(np.minimum(inside, below + self.depth_m), self.reached_m - along)

    def at(self, along: np.ndarray, below: np.ndarray) -> np.ndarray:
        """Return the points (n, 3) [m] of the surface at places (n,) [m] along the path and below it."""
        points = np.column_stack([np.interp(along, self._starts, self.path_m[:, i]) for i in range(3)])
        return points + np.outer(below, self.direction)

    def _range(self, piece: int) -> tuple[float, float]:
        """Return where along the path a piece begins and ends; the first and last go on for ever."""
        last_piece = len(self._flat) - 1
        return (
            -np.inf if piece == 0 else float(self._starts[piece]),
            np.inf if piece == last_piece else float(self._starts[piece + 1]),
        )

    def _on_piece(self, points: np.ndarray, piece: int) -> tuple[np.ndarray, np.ndarray]:
        """Return where ``points`` (n, 3) [m] are along the path and below it, (n,) [m] each, by one piece's frame."""
        from_start = points - self.path_m[piece]
        along, length = from_start @ self._flat[piece], self._starts[piece + 1] - self._starts[piece]
        path_drop = (self.path_m[piece + 1] - self.path_m[piece]) @ self.direction
        return self._starts[piece] + along, from_start @ self.direction - path_drop * np.clip(along / length, 0.0, 1.0)

    def _place(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return points' (n, 3) signed distances from the nearest piece, and places along and below it, (n,) [m]."""
        normals, nearest = self._normals, np.full(len(points), np.inf)
        across, along, below = (np.zeros(len(points)) for _ in range(3))
        for piece, (flat, normal) in enumerate(zip(self._flat, normals, strict=True)):
            from_start = points - self.path_m[piece]
            begin, end = (each - self._starts[piece] for each in self._range(piece))
            foot = np.clip(from_start @ flat, begin, end)
            from_foot = np.column_stack([from_start @ flat - foot, from_start @ normal])
            distance = np.linalg.norm(from_foot, axis=1)
            sign = from_foot[:, 1].copy()
            for end_place, neighbour in ((begin, piece - 1), (end, piece + 1)):
                at_end = foot == end_place
                if at_end.any():  # at a kink both pieces are as near: their mean normal tells the side
                    mean = normal + normals[neighbour]
                    sign[at_end] = (from_start[at_end] - np.outer(foot[at_end], flat)) @ mean
            closer = distance < nearest
            nearest[closer] = distance[closer]
            across[closer] = np.copysign(distance, sign)[closer]
            along[closer] = self._starts[piece] + foot[closer]
            below[closer] = self._on_piece(points, piece)[1][closer]
        return across, along, below


@dataclass(frozen=True, eq=False)
class Cuts(Cut):
    """Several cuts of one body, which may cross: ``across`` of the nearest surface, ``within`` of any."""

    cuts: tuple[Cut, ...]

    @property
    def pieces(self) -> list[Piece]:
        return [piece for cut in self.cuts for piece in cut.pieces]

    @property
    def narrow_m(self) -> float:
        return min(cut.narrow_m for cut in self.cuts)

    def across(self, points: np.ndarray) -> np.ndarray:
        each = np.array([cut.across(points) for cut in self.cuts])
        return each[np.abs(each).argmin(axis=0), np.arange(len(points))]

    def within(self, points: np.ndarray) -> np.ndarray:
        return np.max([cut.within(points) for cut in self.cuts], axis=0)

    def patch(self, spacing_m: float) -> np.ndarray:
        return np.vstack([cut.patch(spacing_m) for cut in self.cuts])

    def front(self, spacing_m: float) -> np.ndarray:
        return np.vstack([cut.front(spacing_m) for cut in self.cuts])


def _count(length_m: float, spacing_m: float) -> int:
    """Return how many points on a line of ``length_m``, ends included, are at most ``spacing_m`` apart."""
    return 1 + int(np.ceil(length_m / spacing_m))


def make_cut(place: str, settings: CutSettings, mesh: Mesh) -> Cut:
    """Make the cut of a body at rest that the settings ``settings`` describe.

    place : where the settings stand, for messages; mesh : of the body
    Raises InputError for settings that describe no cut, and for a cut that misses the body.
    """
    cut = _described(place, settings, mesh)
    if not cut.pieces or cut.severs(*np.swapaxes(mesh.nodes[mesh.edges], 0, 1)).any():
        return cut
    # it may lie within one element
    if not inside(mesh, cut.patch(max(0.25 * cut.narrow_m, 0.01 * mesh.size))).any():
        raise InputError(f"{place} lies outside the body; move it to where it meets the body.")
    return cut


def _described(place: str, settings: CutSettings, mesh: Mesh) -> Cut:
    """Make the cut that the settings describe, wherever it lies; InputError if they describe none, or several."""
    kinds = [kind for kind in ("path_m", "disc", "plane") if getattr(settings, kind) is not None]
    if len(kinds) != 1:
        raise InputError(f"{place} has {' and '.join(kinds) or 'none'} of path_m, disc and plane; give exactly one.")
    if flat := settings.disc or settings.plane:
        if not any(flat.normal):
            raise InputError(f"{place}.{kinds[0]}.normal is [0, 0, 0]; give the direction of the normal.")
        normal = unit(np.array(flat.normal, dtype=float))
        if isinstance(flat, DiscSettings):
            return Disc(np.array(flat.center_m, dtype=float), normal, float(flat.radius_m))
        point, middle = np.array(flat.point_m, dtype=float), 0.5 * (mesh.nodes.min(axis=0) + mesh.nodes.max(axis=0))
        # the disc is around the body, so that its rim is outside
        return Disc(middle - ((middle - point) @ normal) * normal, normal, 2.0 * mesh.size)
    path = np.array(settings.path_m, dtype=float)
    if len(path) < 2:
        raise InputError(f"{place}.path_m has one point; give two or more that the blade is moved along.")
    if settings.depth_m is None:
        raise InputError(f"{place} has a path_m and no depth_m; give the depth of the blade.")
    if settings.direction is None:
        direction = _into(mesh, path)
    elif not any(direction := np.array(settings.direction, dtype=float)):
        raise InputError(f"{place}.direction is [0, 0, 0]; give where the blade points, or leave it out.")
    return blade(mesh, path, unit(direction), float(settings.depth_m))


def blade(mesh: Mesh, path_m: np.ndarray, direction: np.ndarray, depth_m: float) -> Blade:
    """Return the cut of a blade, whose path's ends are open where the blade is outside the body at rest.

    The arguments of ``Blade``; mesh : of the body
    """
    ends = [path_m[i] + depth_m * np.outer(np.linspace(0.0, 1.0, PROBES), direction) for i in (0, -1)]
    open_start, open_end = (not inside(mesh, probes).any() for probes in ends)
    return Blade(path_m, direction, depth_m, (open_start, open_end))


PROBES = 33
"""Points of the blade at each end of its path, none of which is in the body where the blade leaves it; and points of a
path at which normals are taken."""


def inside(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Return which of ``points`` (n, 3) [m] are inside a closed surface and not on it, (n,) bool."""
    corners = mesh.nodes[mesh.triangles]
    return np.array([winding_number(point, corners) > 0.5 * (1.0 + 1e-6) for point in points], dtype=bool)


def _into(mesh: Mesh, path: np.ndarray) -> np.ndarray:
    """Return the direction (3,) into the body below a path: minus the median normal of the triangles nearest to it.

    The median is right for a path that ends at an edge of the body.
    """
    path_places = np.linspace(0.0, len(path) - 1.0, PROBES)
    points = np.column_stack([np.interp(path_places, np.arange(len(path)), path[:, i]) for i in range(3)])
    middles = mesh.nodes[mesh.triangles].mean(axis=1)
    nearest = np.linalg.norm(middles[None] - points[:, None], axis=2).argmin(axis=1)
    return -np.median(unit(area_normals(mesh.nodes, mesh.triangles[nearest])), axis=0)
