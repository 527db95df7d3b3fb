"""Small scenes with contact, and their evaluation by brute force."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, merge_particles, particles_of
from palpate.bodies.simple_shapes import box, sheet
from palpate.scenes.motion import Motion
from palpate.scenes.run_scene import Run, run
from palpate.scenes.settings import Scene

RUBBER = Material(5000.0, 0.3, 1000.0)
NOTHING = np.empty(0, dtype=np.int64)


@pytest.fixture(scope="session")
def cube() -> Callable[..., Particles]:
    """Make a soft cube from the origin, of 0.1 m and ``n`` cells a side."""

    def make(n: int = 1, held: np.ndarray = NOTHING, side: float = 0.1) -> Particles:
        return particles_of(nest("cube", box([side] * 3, [n] * 3), 0, held, RUBBER), 0, False)

    return make


@pytest.fixture(scope="session")
def cloth() -> Callable[..., Particles]:
    """Make a soft sheet in z = 0 from the origin, of 0.1 m and ``n`` cells a side."""

    def make(n: int = 4, held: np.ndarray = NOTHING) -> Particles:
        return particles_of(nest("cloth", sheet([0.1, 0.1], [n, n], 0.002), 0, held, RUBBER), 0, False)

    return make


@pytest.fixture(scope="session")
def play() -> Callable[..., Run]:
    """Run bodies, each moved by its shift, with the blocks of a scene; every step is a frame."""

    def play(parts, shifts=((0.0, 0.0, 0.0),), step_s=0.01, steps=20, held=False, **blocks) -> Run:
        times = {"step_s": step_s, "duration_s": steps * step_s, "frames": steps}
        scene = Scene(name="played", body="played", held=held, **times, **blocks)
        return run(scene, merge_particles(parts, shifts, "played"))

    return play


@pytest.fixture(scope="session")
def trespass() -> Callable[[Motion], tuple[float, int]]:
    """Compute the least clearance [m] in any frame between bodies and balls, rods or floors, and count the edges that
    cross other pieces' triangles and the points inside them, by brute force without palpate.collision."""

    def trespass(motion: Motion, solid: bool = True) -> tuple[float, int]:
        surfaces, room, faults = _pieces(motion.triangles), np.inf, 0
        for frame, x in enumerate(motion.positions):
            corners = [x[triangles] for triangles in surfaces]
            faults += sum(_crossings(a, b) for i, a in enumerate(corners) for b in corners[:i])
            for thing in motion.obstacles:
                ends = thing.positions[frame]
                for a in corners:
                    if thing.kind == "mesh":
                        faults += _crossings(a, ends[thing.triangles])
                    elif thing.kind == "floor":
                        room = min(room, float((a[..., 2] - ends[0, 2]).min()))
                    else:
                        room = min(room, _room(ends[0], ends[-1], a, thing.radius_m))
                    if solid:
                        faults += sum(_winding(p, a) > 0.5 for p in np.linspace(ends[0], ends[-1], 5))
        return room, faults

    return trespass


def _pieces(triangles):
    ends = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]]]).T
    graph = sparse.coo_array((np.ones(ends.shape[1]), ends), shape=[triangles.max() + 1] * 2)
    labels = connected_components(graph, directed=False)[1][triangles[:, 0]]
    return [triangles[labels == label] for label in np.unique(labels)]


def _room(p, q, corners, radius):
    """Compute the clearance between a rod and triangles [m] by ternary search along the axis, as distances to a convex
    set are convex. Triangles whose boxes are farther away are skipped: then the result is a tenth of the radius."""
    reach = 1.1 * radius
    near = (corners.min(axis=1) <= np.maximum(p, q) + reach) & (corners.max(axis=1) >= np.minimum(p, q) - reach)
    corners = corners[near.all(axis=1)]
    if not len(corners):
        return 0.1 * radius
    low, high = np.zeros(len(corners)), np.ones(len(corners))
    for _ in range(70):
        third = (high - low) / 3.0
        left = _from_point(p + (low + third)[:, None] * (q - p), corners) < _from_point(
            p + (high - third)[:, None] * (q - p), corners
        )
        low, high = np.where(left, low, low + third), np.where(left, high - third, high)
    distance = _from_point(p + (0.5 * (low + high))[:, None] * (q - p), corners)
    return min(0.1 * radius, float(distance.min()) - radius)


def _from_point(points, corners):
    """Compute distances (m,) of points (m, 3) from their triangles (m, 3, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = _cross(b - a, c - a)
    normal /= np.sqrt(_dot(normal, normal))[:, None]
    height = _dot(points - a, normal)
    foot = points - height[:, None] * normal
    inside, distance = np.ones(len(corners), dtype=bool), np.full(len(corners), np.inf)
    for u, v in ((a, b), (b, c), (c, a)):
        inside &= _dot(_cross(v - u, foot - u), normal) >= 0.0
        along = np.clip(_dot(points - u, v - u) / _dot(v - u, v - u), 0.0, 1.0)
        away = points - u - along[:, None] * (v - u)
        distance = np.minimum(distance, np.sqrt(_dot(away, away)))
    return np.where(inside, np.abs(height), distance)


def _crossings(a, b):
    """Count the edges of triangles (m, 3, 3) that cross triangles of others, either way, by the signs of volumes."""
    hits = 0
    for first, second in ((a, b), (b, a)):
        low, high = second.min(axis=1), second.max(axis=1)
        for i in range(3):
            p, q = first[:, i], first[:, (i + 1) % 3]
            meet = (np.minimum(p, q)[:, None] <= high) & (low <= np.maximum(p, q)[:, None])
            edge, other = np.nonzero(meet.all(axis=2))
            p, q, (u, v, w) = p[edge], q[edge], (second[other, j] for j in range(3))
            sides = _volume(u, v, w, p) * _volume(u, v, w, q) <= 0.0
            turns = np.array([_volume(p, q, u, v), _volume(p, q, v, w), _volume(p, q, w, u)])
            hits += int((sides & ((turns >= 0.0).all(axis=0) | (turns <= 0.0).all(axis=0))).sum())
    return hits


def _winding(point, corners):
    """Compute how often triangles (m, 3, 3) enclose a point: the sum of their solid angles over 4π."""
    a, b, c = (corners[:, i] - point for i in range(3))
    la, lb, lc = (np.sqrt(_dot(side, side)) for side in (a, b, c))
    below = la * lb * lc + lc * _dot(a, b) + lb * _dot(a, c) + la * _dot(b, c)
    return np.arctan2(_dot(a, _cross(b, c)), below).sum() / (2.0 * np.pi)


def _volume(a, b, c, d):
    return _dot(_cross(b - a, c - a), d - a)


def _dot(a, b):
    return np.einsum("...i,...i->...", a, b)


def _cross(a, b):
    i, j = [1, 2, 0], [2, 0, 1]
    return a[..., i] * b[..., j] - a[..., j] * b[..., i]
