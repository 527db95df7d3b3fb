"""Answer a touch with linear responses of its place, and contact solved in them: the classic of haptics.

Unit pressures on small discs that cover what may be touched have linear responses (James and Pai 1999, "ArtDefo"); of
these the answer is made that the instrument leaves room for (Duriez and others 2006 solve the same as an LCP).
"""

import numpy as np

from palpate.benchmark.model import Setting
from palpate.benchmark.touch import Touch, TouchCase, Touched, TouchSolver, refuse_sticking
from palpate.benchmark.touched_mesh import TouchedMeshes, contact_radius
from palpate.bodies.contacts import spread_over
from palpate.effects.instrument import upright
from palpate.effects.law import PLAIN
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.contact_modes.reduced_contact import Cells, ReducedContact
from palpate.models.contact_modes.snapshots import orthonormal
from palpate.models.touch.reduced_touch import LOOKED_AT, Pushes, ReducedTouch, tilted_ways

LAW = "linear"
COLUMN_RESIDUAL = 1e-4
WIDE = 1.5
"""Radius of a disc over the distance between them."""
SHARES, AROUND = (0.25, 0.5, 0.75, 1.0), 8
"""Depths over the deepest at which searches begin, and the number of tilted pushes: cheap, as no element is asked."""


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
        self._places: dict[int, tuple[ReducedTouch, Pushes]] = {}

    def prepare(self, touch: Touch) -> None:
        if touch.node in self._places:
            return
        case, outward = self._case, self._case.body.fine.normals[touch.node]
        meshes = case.share("touched meshes", lambda: TouchedMeshes(case.body))
        found = meshes.around(Touch(touch.instrument, touch.node, -outward, case.deepest_m), *self._where)
        points, rest = found.problem.points, found.problem.mesh.nodes
        at = points.interpolation @ rest
        reach = WIDE * contact_radius(touch.instrument, case.deepest_m)
        near = np.linalg.norm(at - case.body.fine.nodes[touch.node], axis=1) <= reach
        centers = at[near][spread_over(at[near], self._discs)]
        width = WIDE * reach * np.sqrt(np.pi / self._discs)
        away = np.linalg.norm(at[:, None] - centers, axis=2) / width
        pressures = points.areas[:, None] * np.clip(1.0 - away**2, 0.0, None)
        loads = -(points.interpolation.T @ pressures)[:, None, :] * outward[:, None]
        elements = ElementsAtRest(found.body, found.level)
        modes = orthonormal(elements, elements.solve(np.ascontiguousarray(loads), COLUMN_RESIDUAL))
        count = modes.shape[2]
        none = Cells(np.zeros((9, 0, count)), np.zeros(0), np.zeros(0), np.zeros(0))
        model = ReducedContact(none, np.zeros((count, 0)), PLAIN, np.eye(count))
        place = ReducedTouch(model, modes, points, near, rest, found.up)
        pushes, near[near] = self._pushed(place, touch.node)
        self._places[touch.node] = ReducedTouch(model, modes, points, near, rest, found.up), pushes

    def _pushed(self, place: ReducedTouch, node: int) -> tuple[Pushes, np.ndarray]:
        """Return the pushes that searches begin between, and which of the points (q,) come to the instrument in one."""
        case, body = self._case, self._case.body
        came = np.zeros(len(place.points[2]), dtype=bool)
        ways = tilted_ways(upright(case.instrument, body.fine.nodes[node], body.fine.normals[node]).axes, AROUND)
        pushed, states = [], []
        for way in ways:
            first, q = Touch(case.instrument, node, way, case.deepest_m).pose(body), np.zeros(place.count)
            for share in SHARES:
                pushed.append(share * case.deepest_m * way)
                pose = first.moved(pushed[-1])
                place.settle(pose, q)
                states.append(q.copy())
                came |= place.gaps(pose, q) < LOOKED_AT * case.deepest_m
        return Pushes(ways[0], case.deepest_m, np.array(pushed), np.array(states)), came

    def respond(self, touch: Touch) -> Touched:
        """Answer as ``TouchSolver`` does; TouchDoubted where the search stops early, or unprepared."""
        place, pushes = self._places[touch.node]
        answer = place.answer(touch, touch.pose(self._case.body), pushes.begin(touch))
        pushes.doubt(touch)
        return answer
