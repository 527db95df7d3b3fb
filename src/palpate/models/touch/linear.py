"""Answer a touch with linear responses of its place, and contact solved in them: the classic of haptics.

Unit forces on small discs that cover what may be touched have linear responses (James and Pai 1999, "ArtDefo"), of
which the answer is made that ``disc_contact`` finds. They press along the inward normal of the place, whichever way the
instrument comes.
"""

import numpy as np

from palpate.benchmark.model import Setting
from palpate.benchmark.touch import Touch, TouchCase, TouchDoubted, Touched, TouchSolver, refuse_sticking
from palpate.benchmark.touched_mesh import TouchedMeshes, contact_radius
from palpate.bodies.contacts import spread_over
from palpate.effects.instrument import PUNCH, Instrument
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.touch.disc_contact import OFF, Discs, combined, settle_discs
from palpate.models.touch.reduced_touch import doubt_beyond
from palpate.solvers.indentation import TOUCHED

LAW = "linear"
COLUMN_RESIDUAL = 1e-4
REACH = 1.25
"""Radius of what the discs cover, over that of the deepest contact."""
WIDE = 1.5
"""Radius of a disc over the distance between them."""
SHARP = 0.1
"""Longest step of a punch without a rounded edge, over its radius."""
PLACES = 3
"""Places in which gaps are looked at, by disc."""


def settings(case: TouchCase) -> list[Setting]:
    """List the numbers of discs and the levels of the mesh."""
    return [dict(each) for each in case.grid["linear"]]


def online(case: TouchCase, setting: Setting) -> TouchSolver:
    """Return the model; each place is prepared when it is asked to. LeftOut for an instrument that sticks."""
    refuse_sticking(case, "linear responses of a place")
    return LinearTouch(case, setting)


class LinearTouch(TouchSolver):
    """Linear responses of places, by node."""

    def __init__(self, case: TouchCase, setting: Setting):
        self._case, self._count, self._where = case, setting["discs"], (setting["held"], setting["level"])
        self._places: dict[int, Discs] = {}

    def prepare(self, touch: Touch) -> None:
        if touch.node not in self._places:
            self._places[touch.node] = _discs(self._case, self._where, self._count, touch.node)

    def respond(self, touch: Touch) -> Touched:
        """Answer as ``TouchSolver`` does; TouchDoubted where contact is not solved, or unprepared."""
        discs, body = self._places[touch.node], self._case.body
        doubt_beyond(touch, outward := body.fine.normals[touch.node], self._case.deepest_m)
        begin, steps = touch.pose(body), int(np.ceil(touch.depth_m / _longest(touch.instrument)))
        moves = begin.tip, touch.depth_m * touch.direction, steps, begin.axes, touch.instrument.shape
        forces, off = settle_discs(discs.rest, discs.motions, discs.shares, *moves)
        if not off <= OFF:
            raise TouchDoubted(f"contact was left with gaps of {off:.1%} of the depth", [off])
        if not forces.any():
            raise TouchDoubted("no disc is pressed: they are wider than what touches; take more discs", [])
        whole, pressures = forces.sum(), forces @ discs.shares / discs.areas
        area = discs.areas[pressures > TOUCHED * pressures.max()].sum()
        felt = -whole * float(outward @ touch.direction)
        return Touched(combined(forces, discs.responses).reshape(-1, 3), felt, float(area))


def _longest(instrument: Instrument) -> float:
    """Return the longest step [m] that leaves no place so deep inside that the side, not the end, is nearest."""
    return max(instrument.edge_m, SHARP * instrument.radius_m) if instrument.kind == PUNCH else instrument.radius_m


def _discs(case: TouchCase, where: tuple[int, int], count: int, node: int) -> Discs:
    """Return ``count`` discs around a node; where : levels of the mesh, at the rim of what is held and at the place."""
    place, outward, instrument = case.body.fine.nodes[node], case.body.fine.normals[node], case.instrument
    meshes = case.share("touched meshes", lambda: TouchedMeshes(case.body))
    found = meshes.around(Touch(instrument, node, -outward, case.deepest_m), *where)
    points, rest = found.problem.points, found.problem.mesh.nodes
    at = points.interpolation @ rest
    reach = REACH * contact_radius(instrument, case.deepest_m) + 0.5 * instrument.length_m
    near = np.flatnonzero(np.linalg.norm(at - place, axis=1) <= reach)
    centers = at[near[spread_over(at[near], count)]]
    away = np.linalg.norm(at[:, None] - centers, axis=2) / (WIDE * reach * np.sqrt(np.pi / count))
    pressures = points.areas[:, None] * np.clip(1.0 - away**2, 0.0, None)
    pressures /= pressures.sum(axis=0)
    loads = -(points.interpolation.T @ pressures)[:, None, :] * outward[:, None]
    elements = ElementsAtRest(found.body, found.level)
    columns = elements.solve(np.ascontiguousarray(loads), COLUMN_RESIDUAL)
    flat = columns.reshape(len(rest), -1)
    on = np.flatnonzero(pressures.any(axis=1))
    looked = on[spread_over(at[on], PLACES * count)]
    nearest = np.linalg.norm(at[on][:, None] - at[looked], axis=2).argmin(axis=1)
    shares, areas = np.zeros((len(looked), len(centers))), np.zeros(len(looked))
    np.add.at(shares, nearest, pressures[on])
    np.add.at(areas, nearest, points.areas[on])
    motions = (points.interpolation[looked] @ flat).reshape(len(looked), 3, -1)
    responses = (found.up @ flat).reshape(-1, len(centers))
    return Discs(
        at[looked],
        np.ascontiguousarray(motions.transpose(2, 0, 1)),
        np.ascontiguousarray(shares.T),
        areas,
        np.ascontiguousarray(responses.T),
    )
