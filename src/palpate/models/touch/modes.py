"""Answer a touch with a reduced model of its place, whose modes are presses of quadratic elements by the instrument.

A place is prepared by pushing the instrument straight in and along eight tilted directions, on a mesh that is refined
there. The displacements are the modes, and few cubature points give the energy, as in ``contact_modes``.
"""

import numpy as np

from palpate.benchmark.model import Setting
from palpate.benchmark.touch import Touch, TouchCase, Touched, TouchSolver, refuse_sticking
from palpate.benchmark.touch_mesh import TouchedMeshes
from palpate.effects.instrument import upright
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.reduced.basis import coordinates, orthonormal
from palpate.models.reduced.cubature import energy_of_elements
from palpate.models.touch.reduced_touch import LOOKED_AT, TILT, Pushes, ReducedTouch, doubt_beyond, tilted_ways

LAW = "the body's"
AROUND = 8
"""Number of tilted pushes: between four, a deep and tilted push felt up to 61 % too hard, between eight 3 %."""
STRAIGHT, TILTED = (0.25, 0.5, 0.75, 1.0), (0.35, 0.7, 1.0)
"""Depths of the pushes, over the deepest that is asked for."""
PUSH_TOLERANCE = 3e-2
"""Of the residual of a push. At a third of it, models are no better (0.3 to 0.4 % from elements, force 0.8 %)."""
THINNED = 1e-2
"""Tolerance to which few cubature points pull as all do."""


def settings(case: TouchCase) -> list[Setting]:
    """List meshes from cheap to expensive: the levels at what is held and at the place."""
    return [dict(each) for each in case.grid.modes]


def online(case: TouchCase, held: int, level: int) -> TouchSolver:
    """Return the model; each place is prepared when it is asked to. LeftOut for an instrument that sticks."""
    refuse_sticking(case, "reduced models of a place")
    return TouchModes(case, held, level)


class TouchModes(TouchSolver):
    """Reduced models of places, by node."""

    def __init__(self, case: TouchCase, held: int, level: int):
        self._case, self._where = case, (held, level)
        self._places: dict[int, _Place] = {}

    def prepare(self, touch: Touch) -> None:
        if touch.node not in self._places:
            self._places[touch.node] = _Place(self._case, self._where, touch.node)

    def reduced(self, node: int) -> ReducedTouch:
        """Return the reduced model of a place that was prepared."""
        return self._places[node].reduced

    def respond(self, touch: Touch) -> Touched:
        """Answer as ``TouchSolver`` does; TouchDoubted where the search stops above its tolerance."""
        return self._places[touch.node].answer(touch)


class _Place:
    """One place, prepared for pushes up to the deepest, up to TILT."""

    def __init__(self, case: TouchCase, where: tuple[int, int], node: int):
        meshes = case.share("touched meshes", lambda: TouchedMeshes(case.body))
        outward, instrument = case.body.fine.normals[node], case.instrument
        self._body = case.body
        ways = tilted_ways(upright(instrument, case.body.fine.nodes[node], outward).axes, [TILT], AROUND)
        touches = [Touch(instrument, node, way, case.deepest_m) for way in ways]
        mesh = meshes.around_all(touches, *where)
        problem = mesh.contact
        points, rest = problem.points, problem.mesh.nodes
        pushed: list[np.ndarray] = []
        moved: list[np.ndarray] = []
        stretched = []
        near = np.zeros(len(points.areas), dtype=bool)
        for touch, shares in zip(touches, [STRAIGHT] + [TILTED] * AROUND, strict=True):
            problem.begin([touch.pose(case.body)])
            depths = [share * case.deepest_m for share in shares]

            def guess(depth: float, x: np.ndarray, way: np.ndarray = touch.direction) -> np.ndarray:
                """Return what pushes so far say, with which a search takes a quarter less."""
                if not pushed:
                    return x
                known = Pushes(case.deepest_m, np.array(pushed), np.reshape(moved, (len(moved), -1)))
                return rest + known.begin(depth * way).reshape(-1, 3)

            for state in problem.push(touch.direction, depths, PUSH_TOLERANCE, 1, guess):
                pushed.append(state.depth_m * touch.direction)
                moved.append(state.x - rest)
                gaps = problem.gaps(state.x)
                near |= gaps < LOOKED_AT * case.deepest_m
                stretched.append(state.area_m2 / points.areas[gaps < 0.0].sum())
        elements = ElementsAtRest(mesh.body, mesh.level)
        snapshots = np.stack(moved, axis=2)
        modes = orthonormal(elements, snapshots)
        states = coordinates(elements, snapshots, modes).T
        nowhere, rng = np.zeros(len(elements.couples), dtype=bool), np.random.default_rng(case.seed)
        model = energy_of_elements(elements, modes, nowhere, states, THINNED, rng, moved=moved)
        self.reduced = ReducedTouch(model, modes, points, near, rest, mesh.up)
        self._outward, self._deepest = outward, case.deepest_m
        self._pushes = Pushes(case.deepest_m, np.array(pushed), states)
        self._stretched = float(np.mean(stretched))

    def answer(self, touch: Touch) -> Touched:
        """Return the answer; the search begins at what pushes like it have come to."""
        doubt_beyond(touch, self._outward, self._deepest)
        begun = self._pushes.begin(touch.depth_m * touch.direction)
        return self.reduced.answer(touch, touch.pose(self._body), begun, self._stretched)
