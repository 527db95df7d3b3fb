"""Answer a touch with finite elements: of either order on each level of the body, or on meshes refined at the place."""

from palpate.benchmark.model import Setting, on_own_levels
from palpate.benchmark.touch import Touch, TouchCase, Touched, TouchSolver
from palpate.benchmark.touch_mesh import TouchedMeshes, answer_of, problem_of
from palpate.bodies.refinement import with_midpoints
from palpate.models.fem_statics import to_surface

TOLERANCE = 1e-4
LAW = "the body's"


def settings(case: TouchCase) -> list[Setting]:
    """List meshes from cheap to expensive: by order and level, or by the levels at what is held and at the place."""
    own = on_own_levels(case, case.grid.fem.levels)
    return own + [dict(each) for each in case.grid.fem.local]


def online(case: TouchCase, level: int, order: int = 2, held: int | None = None) -> TouchSolver:
    """Return the elements of a setting; those of a whole level are set up for each touch, as what may touch changes."""
    return LevelTouch(case, level, order) if held is None else LocalTouch(case, held, level)


class LevelTouch(TouchSolver):
    """Elements of one order on a level of the body."""

    def __init__(self, case: TouchCase, level: int, order: int):
        self._level, self._order = level, order
        self._shape = case.body
        self._body = with_midpoints(case.body, level) if order == 2 else case.body
        self._up = to_surface(case.body, level, order)

    def respond(self, touch: Touch) -> Touched:
        problem = problem_of(self._body, self._level, self._order, [touch], self._shape)
        *_, state = problem.push(touch.direction, [touch.depth_m], TOLERANCE)
        return answer_of(problem, state, touch, self._up)


class LocalTouch(TouchSolver):
    """Quadratic elements on a mesh that is refined around the place."""

    def __init__(self, case: TouchCase, held: int, level: int):
        self._meshes = case.share("touched meshes", lambda: TouchedMeshes(case.body))
        self._where = held, level

    def respond(self, touch: Touch) -> Touched:
        return self._meshes.around(touch, *self._where).answer(TOLERANCE)[0]
