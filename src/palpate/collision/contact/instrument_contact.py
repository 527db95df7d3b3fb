"""Contact of rigid instruments on their paths with points of a surface, as kernels of motions take it.

The pressure at a point is k times how deep it is inside: what is searched for is finite everywhere, so that no step of
a search has to be cut short.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np

from palpate.bodies.body import Body
from palpate.collision.contact.friction import Rubbing, along, law
from palpate.collision.contact.obstacles import Obstacle, make_obstacle
from palpate.effects import settings
from palpate.effects.instrument import Tools, gaps_of


@dataclass(eq=False)
class InstrumentContact:
    """Spheres and capsules on their paths, with Coulomb's ``friction``, that creeps below ``slip_m_s`` [m/s].

    reactions : (k, 3) [N], the force on each at the end of the last step; means : (k, 3) [N], over that step
    work_j : theirs on the body; whoever steps writes all three
    """

    obstacles: Sequence[Obstacle]
    friction: float
    slip_m_s: float
    work_j: float = 0.0

    def __post_init__(self) -> None:
        self.reactions = self.means = np.zeros((len(self.obstacles), 3))
        poses = [each.pose(0.0) for each in self.obstacles]
        axes, shapes = np.array([pose.axes for pose in poses]), np.array([pose.instrument.shape for pose in poses])
        self._still = Tools(np.array([pose.tip for pose in poses]), axes, shapes)

    @property
    def crossing_s(self) -> float:
        """The least time [s] in which one of them moves by its radius."""
        return min(each.crossing_s for each in self.obstacles)

    def at(self, t: float) -> Tools:
        """Return where instruments are at the time ``t`` [s]."""
        return self._still._replace(tips=np.array([each.pose(t).tip for each in self.obstacles]))


def instruments_of(body: Body, contact: settings.Contact) -> InstrumentContact:
    """Return the instruments of a block of settings; InputError for others than spheres and capsules."""
    made = [make_obstacle(each, body.name, each.kind, body.fine.size, np.zeros(3)) for each in contact.instruments]
    return InstrumentContact(made, contact.friction, contact.slip_m_s)


@numba.njit(cache=True)
def rubbing_of(points, stiff, tools, coefficient, base, ways, slip):
    """Return the friction of points pressed as at ``points`` (q, 3) [m] by ``tools``, a step's argument of ``pushes``.

    It is that against motion from ``base`` (q, 3) [m], while instruments move by ``ways`` (k, 3) [m]; slip : [m]
    """
    gaps, normals = gaps_of(points, tools)
    return Rubbing(normals, coefficient * (stiff * np.maximum(-gaps, 0.0)), slip, base, ways)


@numba.njit(cache=True)
def _slide(point, start, way, normal, u):
    """Write how far a point slides along an instrument to ``u`` (3,), and return its length [m]."""
    for i in range(3):
        u[i] = point[i] - start[i] - way[i]
    return along(u, normal)


@numba.njit(cache=True, error_model="numpy")
def pushes(points, stiff, tools, rubbing):
    """Return each instrument's forces (k, q, 3) [N] on ``points`` (q, 3) [m], and energies (q,) [J], with friction's.

    stiff : (q,) [N/m], or [Pa/m]; then all, that of ``rubbing_of`` included, is over an area
    """
    gaps, normals = gaps_of(points, tools)
    held, limits, slip, start, ways = rubbing
    forces, energies, u = np.zeros(normals.shape), np.zeros(len(points)), np.empty(3)
    for k in range(len(gaps)):
        for q in range(len(points)):
            if gaps[k, q] < 0.0:
                energies[q] += 0.5 * stiff[q] * gaps[k, q] ** 2
                for i in range(3):
                    forces[k, q, i] = -stiff[q] * gaps[k, q] * normals[k, q, i]
            if limits[k, q] > 0.0:
                potential, resistance, _ = law(_slide(points[q], start[q], ways[k], held[k, q], u), slip)
                energies[q] += limits[k, q] * potential
                for i in range(3):
                    forces[k, q, i] -= limits[k, q] * resistance * u[i]
    return forces, energies


@numba.njit(cache=True, error_model="numpy")
def stiffness(points, stiff, tools, rubbing, chosen):
    """Return blocks (c, 3, 3) [N/m] of the ``chosen`` (c,) points, without what curvature and sliding take off."""
    gaps, normals = gaps_of(points, tools)
    held, limits, slip, start, ways = rubbing
    blocks, u = np.zeros((len(chosen), 3, 3)), np.empty(3)
    for k in range(len(gaps)):
        for c in range(len(chosen)):
            q, rubbed = chosen[c], 0.0
            if limits[k, q] > 0.0:
                rubbed = limits[k, q] * law(_slide(points[q], start[q], ways[k], held[k, q], u), slip)[1]
            pressed = stiff[q] if gaps[k, q] < 0.0 else 0.0
            for i in range(3):
                blocks[c, i, i] += rubbed
                for j in range(3):
                    turned = pressed * normals[k, q, i] * normals[k, q, j] - rubbed * held[k, q, i] * held[k, q, j]
                    blocks[c, i, j] += turned
    return blocks
