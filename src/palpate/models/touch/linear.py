"""Answer a touch with linear responses of its place, and contact solved in them: the classic of haptics.

Unit pressures on small discs that cover what may be touched have linear responses (James and Pai 1999, "ArtDefo"); of
these the answer is made that the instrument leaves room for (Duriez and others 2006 solve the same as an LCP).
"""

import numpy as np

from palpate.benchmark.model import Setting
from palpate.benchmark.touch import Touch, TouchCase, Touched, TouchSolver, refuse_sticking
from palpate.benchmark.touched_mesh import TouchedMeshes, contact_radius
from palpate.bodies.contacts import spread_over
from palpate.effects.law import PLAIN
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.contact_modes.reduced_contact import Cells, ReducedContact
from palpate.models.contact_modes.snapshots import orthonormal
from palpate.models.touch.reduced_touch import ReducedTouch

LAW = "linear"
COLUMN_RESIDUAL = 1e-4
WIDE = 1.5
"""Radius of a disc over the distance between them."""


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
        self._case, self._discs, self._where = case, setting["discs"], (setting["held"], setting["level"])
        self._places: dict[int, ReducedTouch] = {}

    def prepare(self, touch: Touch) -> None:
        if touch.node in self._places:
            return
        case, outward = self._case, self._case.body.fine.normals[touch.node]
        meshes = case.share("touched meshes", lambda: TouchedMeshes(case.body))
        found = meshes.around(Touch(touch.instrument, touch.node, -outward, case.deepest_m), *self._where)
        points, rest = found.problem.points, found.problem.mesh.nodes
        at, place = points.interpolation @ rest, case.body.fine.nodes[touch.node]
        reach = WIDE * contact_radius(touch.instrument, case.deepest_m)
        near = np.linalg.norm(at - place, axis=1) <= reach
        centers = at[near][spread_over(at[near], self._discs)]
        width = WIDE * reach * np.sqrt(np.pi / self._discs)
        away = np.linalg.norm(at[:, None] - centers, axis=2) / width
        pressures = points.areas[:, None] * np.clip(1.0 - away**2, 0.0, None)
        loads = -(points.interpolation.T @ pressures)[:, None, :] * outward[:, None]
        elements = ElementsAtRest(found.body, self._where[1])
        modes = orthonormal(elements, elements.solve(np.ascontiguousarray(loads), COLUMN_RESIDUAL))
        count = modes.shape[2]
        none = Cells(np.zeros((9, 0, count)), np.zeros(0), np.zeros(0), np.zeros(0))
        model = ReducedContact(none, np.zeros((count, 0)), PLAIN, np.eye(count))
        self._places[touch.node] = ReducedTouch(model, modes, points, near, rest, found.up)

    def respond(self, touch: Touch) -> Touched:
        """Answer as ``TouchSolver`` does; TouchDoubted where the search stops above its tolerance."""
        place = self._places[touch.node]
        return place.answer(touch, touch.pose(self._case.body), np.zeros(place.count))
