"""Contact of spheres and capsules with points of a surface, for searches in few coordinates.

The pressure at a point is k times how deep it is inside, as ``solvers.touched_motion`` has it: what is searched for is
finite everywhere, so that no step of a search has to be cut short.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np

from palpate.collision.contact import friction
from palpate.collision.contact.friction import Rubbing
from palpate.collision.contact.obstacles import Obstacle
from palpate.effects.instrument import CAPSULE, SPHERE, Instrument, Pose, distances
from palpate.errors import InputError


class Path:
    """The way of an ``obstacle``, a sphere or a capsule, and its ``axes`` as a Pose has them; InputError for others."""

    def __init__(self, obstacle: Obstacle):
        if obstacle.kind not in (SPHERE, CAPSULE):
            raise InputError(
                f"{obstacle.name} is a {obstacle.kind}; motions of what is touched know spheres and capsules."
            )
        ends = obstacle.points
        along = ends[-1] - ends[0]
        length = float(np.linalg.norm(along))
        self.instrument = Instrument(obstacle.kind, obstacle.radius_m, length_m=length)
        self.obstacle = obstacle
        first = along / length if length else np.eye(3)[0]
        second = np.cross(np.eye(3)[np.abs(first).argmin()], first)
        second /= np.linalg.norm(second)
        self.axes = np.array([first, second, np.cross(first, second)])
        self._start = ends.mean(axis=0) - self.instrument.radius_m * self.axes[2]

    @property
    def times_s(self) -> np.ndarray:
        """When it is where the path has corners, (k,) [s]."""
        return self.obstacle.times_s

    def tip(self, t: float) -> np.ndarray:
        """Return its lowest point (3,) [m] at the time ``t`` [s]."""
        return self._start + self.obstacle.shift(t)

    def pose(self, t: float) -> Pose:
        """Return where it is at the time ``t`` [s]."""
        return Pose(self.instrument, self.tip(t), self.axes)


class Tools(NamedTuple):
    """Where k instruments are, as kernels take them: tips (k, 3) [m], axes (k, 3, 3), radii, half lengths (k,) [m]."""

    tips: np.ndarray
    axes: np.ndarray
    radii: np.ndarray
    halves: np.ndarray


@dataclass(eq=False)
class InstrumentContact:
    """Instruments on their paths, with Coulomb's ``friction``, that creeps below ``slip_m_s`` [m/s].

    reactions : (k, 3) [N], the force on each at the end of the last step; means : (k, 3) [N], over that step
    work_j : theirs on the body; whoever steps writes all three
    """

    paths: Sequence[Path]
    friction: float
    slip_m_s: float
    work_j: float = 0.0

    def __post_init__(self) -> None:
        self.reactions = self.means = np.zeros((len(self.paths), 3))
        shapes = np.array([path.instrument.shape for path in self.paths])
        axes = np.array([path.axes for path in self.paths])
        self._still = Tools(np.empty((len(axes), 3)), axes, shapes[:, 1].copy(), shapes[:, 3].copy())

    @property
    def crossing_s(self) -> float:
        """The least time [s] in which one of them moves by its radius."""
        return min(path.obstacle.crossing_s for path in self.paths)

    def poses(self, t: float) -> list[Pose]:
        """Return where instruments are at the time ``t`` [s]."""
        return [path.pose(t) for path in self.paths]

    def at(self, t: float) -> Tools:
        """Return the same as kernels take it."""
        return self._still._replace(tips=np.array([path.tip(t) for path in self.paths]))


@numba.njit(cache=True, error_model="numpy")
def gaps_of(points, tools):
    """Return the distances (k, q) [m] of ``points`` (q, 3) [m] from ``tools``, and their gradients (k, q, 3)."""
    tips, axes, radii, halves = tools
    gaps, normals = np.empty((len(tips), len(points))), np.empty((len(tips), len(points), 3))
    for k in range(len(tips)):
        distances(points, tips[k], axes[k], 1, radii[k], 0.0, halves[k], gaps[k], normals[k])
    return gaps, normals


@numba.njit(cache=True)
def rubbing_of(points, stiff, tools, coefficient, base, ways, slip):
    """Return the friction of points pressed as at ``points`` (q, 3) [m] by ``tools``, a step's argument of ``pushes``.

    It is that against motion from ``base`` (q, 3) [m], while instruments move by ``ways`` (k, 3) [m]; slip : [m]
    """
    gaps, normals = gaps_of(points, tools)
    limits, starts = coefficient * stiff * np.maximum(-gaps, 0.0), np.empty_like(normals)
    for k in range(len(ways)):
        starts[k] = base + ways[k]
    nodes = np.arange(len(points)).reshape(-1, 1)
    return Rubbing(nodes, np.ones((len(points), 1)), normals, limits, slip, starts)


@numba.njit(cache=True, error_model="numpy")
def pushes(points, stiff, tools, rubbing):
    """Return each instrument's forces (k, q, 3) [N] on ``points`` (q, 3) [m], and their energy [J], with friction's.

    stiff : (q,) [N/m]
    """
    gaps, normals = gaps_of(points, tools)
    nodes, weights, held, limits, slip, starts = rubbing
    forces, energy = np.zeros(normals.shape), 0.0
    for k in range(len(gaps)):
        for q in range(len(points)):
            if gaps[k, q] < 0.0:
                energy += 0.5 * stiff[q] * gaps[k, q] ** 2
                for i in range(3):
                    forces[k, q, i] = -stiff[q] * gaps[k, q] * normals[k, q, i]
        energy += friction.energy(nodes, weights, held[k], limits[k], slip, points, starts[k])
        friction.add_force(nodes, weights, held[k], limits[k], slip, points, starts[k], forces[k])
    return forces, energy


@numba.njit(cache=True, error_model="numpy")
def stiffness(points, stiff, tools, rubbing, chosen):
    """Return blocks (c, 3, 3) [N/m] of the ``chosen`` (c,) points, without what curvature and sliding take off."""
    gaps, normals = gaps_of(points, tools)
    nodes, weights, held, limits, slip, starts = rubbing
    blocks = np.zeros((len(chosen), 3, 3))
    for k in range(len(gaps)):
        rubbed = held[k][chosen], limits[k][chosen], slip, points, starts[k]
        blocks += friction.blocks(nodes[chosen], weights[chosen], *rubbed, True)[:, 0, 0]
        for c in range(len(chosen)):
            q = chosen[c]
            if gaps[k, q] < 0.0:
                for i in range(3):
                    for j in range(3):
                        blocks[c, i, j] += stiff[q] * normals[k, q, i] * normals[k, q, j]
    return blocks
