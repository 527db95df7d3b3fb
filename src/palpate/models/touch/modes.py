"""Answer a touch with a reduced model of its place, whose modes are presses of quadratic elements by the instrument.

A place is prepared by pushing the instrument straight in and along eight tilted directions, on a mesh that is refined
there. The displacements are the modes, and few cubature points give the energy, as in ``contact_modes``.
"""

import numpy as np

from palpate.benchmark.model import Setting
from palpate.benchmark.touch import Touch, TouchCase, TouchDoubted, Touched, TouchSolver, refuse_sticking
from palpate.benchmark.touch_mesh import TouchedMeshes
from palpate.effects.instrument import upright
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.reduced.basis import coordinates, orthonormal
from palpate.models.reduced.cubature import energy_of_elements
from palpate.models.touch.reduced_touch import LOOKED_AT, TILT, Pushes, doubt_beyond, settle_touching, tilted_ways

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


RESIDUAL, ITERATIONS = 1e-3, 30
"""Residual of an answer over the force of contact, and most of Newton's iterations."""
STIFFER = 2.0
"""Penalty over that of the elements, whose multipliers are lacking."""


class ReducedTouch:
    """A reduced model of one place in r coordinates, prepared by pushes up to the deepest and tilted up to TILT.

    model : its energy; points : of the surface that may be touched, as ``settle_touching`` takes them
    surface : (3 n_surface, r), the motion of the fine surface, in float32, as it takes long to read
    """

    def __init__(self, case: TouchCase, where: tuple[int, int], node: int):
        meshes = case.share("touched meshes", lambda: TouchedMeshes(case.body))
        outward, instrument = case.body.fine.normals[node], case.instrument
        self._body, self._outward, self._deepest = case.body, outward, case.deepest_m

        # displacements of the elements under pushes in all directions
        directions = tilted_ways(upright(instrument, case.body.fine.nodes[node], outward).axes, [TILT], AROUND)
        touches = [Touch(instrument, node, direction, case.deepest_m) for direction in directions]
        mesh = meshes.around_all(touches, *where)
        problem = mesh.contact
        points, rest = problem.points, problem.mesh.nodes
        pushed: list[np.ndarray] = []
        moved: list[np.ndarray] = []
        area_ratios = []
        near = np.zeros(len(points.areas), dtype=bool)
        for touch, shares in zip(touches, [STRAIGHT] + [TILTED] * AROUND, strict=True):
            problem.begin([touch.pose(case.body)])
            depths = [share * case.deepest_m for share in shares]

            def guess(depth: float, x: np.ndarray, direction: np.ndarray = touch.direction) -> np.ndarray:
                """Return the positions that earlier pushes predict; a search from there takes a quarter less."""
                if not pushed:
                    return x
                earlier = Pushes(case.deepest_m, np.array(pushed), np.reshape(moved, (len(moved), -1)))
                return rest + earlier.begin(depth * direction).reshape(-1, 3)

            for state in problem.push(touch.direction, depths, PUSH_TOLERANCE, 1, guess):
                pushed.append(state.depth_m * touch.direction)
                moved.append(state.x - rest)
                gaps = problem.gaps(state.x)
                near |= gaps < LOOKED_AT * case.deepest_m
                area_ratios.append(state.area_m2 / points.areas[gaps < 0.0].sum())
        self._stretched = float(np.mean(area_ratios))

        # modes of these displacements, and the energy of few points
        elements = ElementsAtRest(mesh.body, mesh.level)
        snapshots = np.stack(moved, axis=2)
        modes = orthonormal(elements, snapshots)
        states = coordinates(elements, snapshots, modes).T
        no_element, rng = np.zeros(len(elements.couples), dtype=bool), np.random.default_rng(case.seed)
        self.model = energy_of_elements(elements, modes, no_element, states, THINNED, rng, moved=moved)
        self._pushes = Pushes(case.deepest_m, np.array(pushed), states)

        flat_modes, interpolation = modes.reshape(len(rest), -1), points.interpolation[near]
        moved_by_modes = (interpolation @ flat_modes).reshape(-1, self.count)
        self.points = (interpolation @ rest).ravel(), moved_by_modes, points.areas[near], STIFFER * points.penalty[near]
        self.surface = (mesh.up @ flat_modes).reshape(-1, self.count).astype(np.float32)

    @property
    def count(self) -> int:
        """The number of coordinates."""
        return len(self.model.rest)

    def expected(self, touch: Touch) -> np.ndarray:
        """Return the coordinates (r,) that pushes like ``touch`` predict for it."""
        return self._pushes.begin(touch.depth_m * touch.direction)

    def answer(self, touch: Touch, q: np.ndarray) -> Touched:
        """Answer ``touch``, by a search from coordinates ``q`` (r,), which it overwrites; TouchDoubted if it fails."""
        doubt_beyond(touch, self._outward, self._deepest)
        pose = touch.pose(self._body).moved(touch.depth_m * touch.direction)
        where = self.points, pose.tip, pose.axes, pose.instrument.shape
        force, area, residual = settle_touching(q, self.model.body, self.model.base, *where, RESIDUAL, ITERATIONS)
        if not residual <= RESIDUAL:
            raise TouchDoubted(f"the reduced model stopped at a residual of {residual:.1e}", [residual])
        moved = (self.surface @ q.astype(np.float32)).reshape(-1, 3).astype(float)
        return Touched(moved, float(force @ touch.direction), self._stretched * area)


class TouchModes(TouchSolver):
    """Reduced models of places, by node."""

    def __init__(self, case: TouchCase, held: int, level: int):
        self._case, self._where = case, (held, level)
        self._places: dict[int, ReducedTouch] = {}

    def prepare(self, touch: Touch) -> None:
        if touch.node not in self._places:
            self._places[touch.node] = ReducedTouch(self._case, self._where, touch.node)

    def reduced(self, node: int) -> ReducedTouch:
        """Return the reduced model of a place that was prepared."""
        return self._places[node]

    def respond(self, touch: Touch) -> Touched:
        """Answer as ``TouchSolver`` does; TouchDoubted where the search stops above its tolerance."""
        place = self._places[touch.node]
        return place.answer(touch, place.expected(touch))
