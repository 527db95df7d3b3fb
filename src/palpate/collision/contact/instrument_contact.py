"""Contact of points of a surface with rigid instruments on their paths: the penalty and friction of motions.

The pressure at a point is k times its depth inside an instrument. This energy is finite everywhere, unlike a barrier,
so that no step of a search has to be limited.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np

from palpate.bodies.body import Body
from palpate.collision.contact.friction import Rubbing, law, tangential
from palpate.collision.contact.obstacles import Obstacle, make_obstacle
from palpate.effects import settings
from palpate.effects.instrument import Tools, gaps_of


@dataclass(eq=False)
class InstrumentContact:
    """Spheres and capsules on their paths, with the coefficient of ``friction``, which creeps below ``slip_m_s`` [m/s].

    The integrator writes the following.
    reactions : (k, 3) [N], the force on each at the end of the last step; means : (k, 3) [N], over that step
    work_j : their work on the body
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
        """The shortest time [s] in which one of the instruments moves by its radius."""
        return min(each.crossing_s for each in self.obstacles)

    def at(self, t: float) -> Tools:
        """Return the poses of the instruments at the time ``t`` [s]."""
        return self._still._replace(tips=np.array([each.pose(t).tip for each in self.obstacles]))


def instruments_of(body: Body, contact: settings.Contact) -> InstrumentContact:
    """Return the instruments of a block of settings; InputError for others than spheres and capsules."""
    made = [make_obstacle(each, body.name, each.kind, body.fine.size, np.zeros(3)) for each in contact.instruments]
    return InstrumentContact(made, contact.friction, contact.slip_m_s)


@numba.njit(cache=True)
def rubbing_of(points, stiff, tools, coefficient, base, shifts, slip):
    """Return the friction of a step, with the normals and pressures that ``points`` (q, 3) [m] have under ``tools``.

    stiff : (q,) as of ``pushes``; coefficient : of friction; base : (q, 3) [m], points at the start of the step
    shifts : (k, 3) [m], displacements of the instruments in it; slip : [m], from which friction is at its limit
    """
    gaps, normals = gaps_of(points, tools)
    return Rubbing(normals, coefficient * (stiff * np.maximum(-gaps, 0.0)), slip, base, shifts)


@numba.njit(cache=True)
def _slide(point, start, shift, normal, u):
    """Write the tangential displacement of a point relative to an instrument to ``u`` (3,); return its length [m]."""
    for i in range(3):
        u[i] = point[i] - start[i] - shift[i]
    return tangential(u, normal)


@numba.njit(cache=True, error_model="numpy")
def pushes(points, stiff, tools, rubbing):
    """Return each instrument's forces (k, q, 3) [N] on ``points`` (q, 3) [m], and energies (q,) [J], with friction.

    stiff : (q,) [N/m], the penalty; with one in [Pa/m], also in ``rubbing_of``, forces and energies are per area
    """
    gaps, normals = gaps_of(points, tools)
    lagged, limits, slip, start, shifts = rubbing
    forces, energies, u = np.zeros(normals.shape), np.zeros(len(points)), np.empty(3)
    for k in range(len(gaps)):
        for q in range(len(points)):
            if gaps[k, q] < 0.0:
                energies[q] += 0.5 * stiff[q] * gaps[k, q] ** 2
                for i in range(3):
                    forces[k, q, i] = -stiff[q] * gaps[k, q] * normals[k, q, i]
            if limits[k, q] > 0.0:
                potential, resistance, _ = law(_slide(points[q], start[q], shifts[k], lagged[k, q], u), slip)
                energies[q] += limits[k, q] * potential
                for i in range(3):
                    forces[k, q, i] -= limits[k, q] * resistance * u[i]
    return forces, energies


@numba.njit(cache=True, error_model="numpy")
def stiffness(points, stiff, tools, rubbing, chosen):
    """Return blocks (c, 3, 3) [N/m] of points ``chosen`` (c,) without negative terms; lagged : normals of friction."""
    gaps, normals = gaps_of(points, tools)
    lagged, limits, slip, start, shifts = rubbing
    blocks, u = np.zeros((len(chosen), 3, 3)), np.empty(3)
    for k in range(len(gaps)):
        for c in range(len(chosen)):
            q, rubbed = chosen[c], 0.0
            if limits[k, q] > 0.0:
                rubbed = limits[k, q] * law(_slide(points[q], start[q], shifts[k], lagged[k, q], u), slip)[1]
            pressed = stiff[q] if gaps[k, q] < 0.0 else 0.0
            for i in range(3):
                blocks[c, i, i] += rubbed
                for j in range(3):
                    entry = pressed * normals[k, q, i] * normals[k, q, j] - rubbed * lagged[k, q, i] * lagged[k, q, j]
                    blocks[c, i, j] += entry
    return blocks
