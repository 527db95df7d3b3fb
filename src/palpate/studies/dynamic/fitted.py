"""Models that are fitted to another motion: springs, shape matching, corrected coarse FEM, and modes."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from time import perf_counter
from typing import Any

import numpy as np
from scipy.optimize import minimize

from palpate.benchmark.comparable import LOADS
from palpate.benchmark.measuring import Prepared, prepared
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import particles_of
from palpate.effects.settings import Loads, Push, ShapeMatching, Springs
from palpate.errors import InputError, NotConverged
from palpate.linalg.multigrid import Factor
from palpate.models.enrichment.detail_correction import NodalRotations
from palpate.models.fem_statics import to_surface
from palpate.models.reduced_body import BodyAtRest, ReducedBody
from palpate.models.reduced_motion import prepare
from palpate.models.shape_matching import cubes
from palpate.models.springs.fitness import volume_stiffness
from palpate.models.springs.spring_motion import spring_model
from palpate.scenes.motion import Motion
from palpate.scenes.run_scene import compose
from palpate.scenes.settings import Scene
from palpate.studies.dynamic.compared_scene import ComparedScene


@dataclass(frozen=True)
class Fitted:
    """A model with its parameters found: ``scene(compared, steps)``, the modulus for its particles, what the fit took.

    finish : what makes displacements (f, n_surface, 3) [m] of its motion, if interpolation does not
    level : which it moves, 0 is the coarse one, −1 the reference's
    """

    scene: Callable[[ComparedScene, int], Scene]
    young_pa: float
    offline_s: float
    finish: Callable[[Motion], np.ndarray] | None = None
    level: int = 0


def fit_springs(lesson: ComparedScene, wanted: np.ndarray, volume: bool, step_share: float, evaluations: int) -> Fitted:
    """Fit a modulus, the dampers' ratio and a sheet's bending springs, in so many motions at most.

    lesson, wanted : the motion to fit, and its displacements (f, n_surface, 3) [m]
    volume : with the volume force that the Poisson ratio calls for
    step_share : of the longest stable step, at which it is fitted
    """
    begin, given = perf_counter(), lesson.body.material
    bulk = 0.0
    if volume:
        bulk = volume_stiffness(spring_model(particles_of(lesson.body, 0, surface=False)), given)

    def young_pa(q: np.ndarray) -> float:
        return float(given.young_pa * np.exp(q[0]))

    def scene(compared: ComparedScene, steps: int, q: np.ndarray) -> Scene:
        stiffness = Springs()
        if compared.thickness_m:  # the modulus times the thickness [N/m], and a share of that against bending
            along = compared.thickness_m * young_pa(q)
            stiffness = Springs(structural_n_m=along, shear_n_m=along, bending_n_m=float(np.exp(q[2])) * along)
        return compared.springs(steps, stiffness, float(np.exp(q[1])), bulk * young_pa(q) / given.young_pa)

    def misfit(q: np.ndarray) -> float:
        limit = lesson.limit_s(scene(lesson, lesson.frames, q), young_pa(q))
        return error_of(lesson, scene(lesson, lesson.steps(step_share * limit), q), young_pa(q), wanted)

    start, sides, bounds = [0.0, np.log(0.1)], [-0.4, 0.7], [(-2.3, 2.3), (-6.0, 1.0)]
    if lesson.thickness_m:
        start, sides, bounds = [*start, -4.0], [*sides, 1.5], [*bounds, (-9.0, 1.0)]
    q = _simplex(misfit, np.array(start), sides, bounds, evaluations, f"{lesson.name}: no springs")
    return Fitted(lambda compared, steps: scene(compared, steps, q), young_pa(q), perf_counter() - begin)


def fit_shapes(lesson: ComparedScene, wanted: np.ndarray, per_frame: int, evaluations: int) -> Fitted:
    """Fit α, β, the decay of velocities and the scale of the loads, for so many steps a frame: α m/h² depends on them.

    Where the body falls or is met by an instrument, loads are what they are.
    """
    begin, young, steps = perf_counter(), lesson.body.material.young_pa, per_frame * lesson.frames
    clusters = cubes(lesson.body.coarse)
    scaled = lesson.held and not lesson.loads.contact

    def scene(compared: ComparedScene, steps: int, q: np.ndarray) -> Scene:
        matching = ShapeMatching(mode="linear", alpha=float(q[0]), beta=float(q[1]), clusters=clusters)
        loaded = compared.scale_loads(float(np.exp(q[3]))) if scaled else compared
        return loaded.shapes(steps, matching, float(np.exp(q[2])))

    def misfit(q: np.ndarray) -> float:
        return error_of(lesson, scene(lesson, steps, q), young, wanted)

    bounds, sides = [(0.02, 1.0), (0.0, 0.99), (-5.0, 7.0)], [0.25, 0.3, -1.0]
    starts = [np.array([alpha, beta, 1.6]) for alpha, beta in product((0.3, 0.9), (0.2, 0.7))]
    if scaled:
        bounds, sides = [*bounds, (-12.0, 12.0)], [*sides, 0.7]
        starts = [np.array([0.7, 0.4, 1.6, scale]) for scale in np.arange(-6.0, 6.1, 1.5)]
    q = _simplex(misfit, min(starts, key=misfit), sides, bounds, evaluations, f"{lesson.name}: no shapes")
    return Fitted(lambda compared, steps: scene(compared, steps, q), young, perf_counter() - begin)


def error_of(compared: ComparedScene, scene: Scene, young_pa: float, wanted: np.ndarray) -> float:
    """Return the RMSE of a motion over all frames and nodes over the peak of ``wanted`` (f, n_surface, 3) [m], or 1."""
    try:
        moved = compared.move(scene, 0, young_pa)[0]
    except (NotConverged, InputError):  # diverged, or its steps are too long: as wrong as no motion
        return 1.0
    rmse = np.sqrt(np.mean(np.sum((moved - wanted) ** 2, axis=2))) / np.linalg.norm(wanted, axis=2).max()
    return float(min(rmse, 1.0))


def _simplex(misfit: Callable, start: np.ndarray, sides: list, bounds: list, evaluations: int, what: str) -> np.ndarray:
    corners = np.vstack([start, start + np.diag(sides)])
    options = {"maxfev": evaluations, "initial_simplex": corners, "xatol": 1e-3, "fatol": 1e-5}
    found = minimize(misfit, start, method="Nelder-Mead", bounds=bounds, options=options)
    if not found.fun < 1.0:
        raise NotConverged(f"{what} move like the reference; lower the loads", [])
    return found.x


def corrects(compared: ComparedScene) -> bool:
    """Return whether all that acts has a linear response: a held solid under gravity and pushes."""
    return _held_solid(compared) and set(compared.loads.given()) <= set(LOADS) and len(compared.body.levels) > 1


def _held_solid(compared: ComparedScene) -> bool:
    return compared.held and not compared.shifts_m and not compared.thickness_m


class CorrectedMotion:
    """x_f = P x_c + R Σ a D: a coarse motion with the detail D of each load, scaled by how far the body has moved.

    The coarse modulus is divided by ``softness``, so that coarse and fine linear responses have the same compliance;
    a coarse mesh is too stiff, and would swing too fast. D is the linear fine response less the coarse one of that
    modulus, both interpolated to the fine surface, (k, n_surface, 3) [m] for k loads. a is the least-squares share of
    each coarse response in the coarse displacement, weighted by mass, so that detail follows inertia, too. R turns
    detail by the rotation of the coarse material, as corrected coarse FEM does in statics (docs/method.md).
    """

    def __init__(self, compared: ComparedScene):
        last = len(compared.body.levels) - 1
        (coarse, loads), (fine, fine_loads) = _responses(compared, 0), _responses(compared, last)
        self.softness = float(np.vdot(fine_loads, fine) / np.vdot(loads, coarse))
        coarse = self.softness * coarse
        self._up = to_surface(compared.body, 0)
        fine_up = to_surface(compared.body, last)
        self.detail = np.array([fine_up @ u - self._up @ c for u, c in zip(fine, coarse, strict=True)])
        masses = np.sqrt(np.repeat(compared.particles(0).masses, 3))
        self._shares = np.linalg.pinv((coarse.reshape(len(coarse), -1) * masses).T) * masses
        assert isinstance(compared.body.coarse, TetMesh)  # as ``corrects`` asks for
        self._rotations = NodalRotations(compared.body.coarse)

    def correct(self, motion: Motion) -> np.ndarray:
        """Return displacements (f, n_surface, 3) [m] of the fine surface after each frame of a coarse motion."""
        return np.array([self._corrected(x - motion.rest) for x in motion.positions[1:]])

    def _corrected(self, moved: np.ndarray) -> np.ndarray:
        turns = (self._up @ self._rotations.at(moved).reshape(-1, 9)).reshape(-1, 3, 3)
        detail = np.tensordot(self._shares @ moved.ravel(), self.detail, axes=1)
        return self._up @ moved + (turns @ detail[:, :, None])[:, :, 0]


def fit_correction(compared: ComparedScene) -> Fitted:
    """Prepare the correction of a compared scene; nothing is learnt, so no motion to fit to is needed."""
    begin = perf_counter()
    found = CorrectedMotion(compared)
    young = compared.body.material.young_pa / found.softness
    return Fitted(ComparedScene.fem, young, perf_counter() - begin, found.correct)


def _responses(compared: ComparedScene, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Return linear responses (k, n, 3) [m] of a level to each load at its height, and the loads (k, n, 3) [N]."""
    particles, loads = compared.particles(level), []
    singles = [Loads(gravity=compared.loads.gravity)] if compared.loads.gravity else []
    singles += [Loads(push=Push(loads=[push])) for push in compared.loads.pushes]
    for single in (replace(compared, loads=each) for each in singles):
        system = compose(single.fem(single.frames), particles)
        for push in single.loads.pushes:
            system.at(push.start_s + push.press_s)
        still = np.zeros_like(particles.nodes)
        loads.append(system.outer_force(particles.nodes, still) + system.potential_force(particles.nodes))
    matrix = system.stiffness(particles.nodes, definite=True)
    assert matrix is not None  # finite elements have one
    system.hold(matrix)
    factor = Factor(matrix)
    return np.array([factor.solve(load) for load in loads]), np.array(loads)


@dataclass(frozen=True)
class MadeModes:
    """A body at rest, whatever of it all places share, and the time that took [s]."""

    at_rest: BodyAtRest
    seconds: float

    @classmethod
    def of(cls, compared: ComparedScene, grid: Mapping[str, Any]) -> "MadeModes":
        begin = perf_counter()
        return cls(BodyAtRest(compared.body, grid["vibrations"]), perf_counter() - begin)

    def at(self, compared: ComparedScene, grid: Mapping[str, Any], missed: float) -> ReducedBody:
        """Reduce the body for the loads of ``compared``; NotConverged where cells do not suffice."""
        return prepare(self.at_rest, compared.placed_loads(), compared.rayleigh, grid["bent"], missed)


def moving_modes(
    compared: ComparedScene,
    lesson: ComparedScene | None,
    grid: Mapping[str, Any],
    made: MadeModes | None = None,
    other: ReducedBody | None = None,
) -> Iterator[tuple[int, Prepared, str]]:
    """Yield steps in modes for the pushes of ``compared``, then, at the middle step, other cells and another place.

    What answers is a reduced body. Nothing is learnt: of the lesson's motion its places are taken alone, to see what a
    push elsewhere comes to.
    made, other : the body at rest, and its modes for another place, if they are known; otherwise made of the lesson
    """
    made, counts = made or MadeModes.of(compared, grid), grid["steps_per_frame"]
    middle = counts[len(counts) // 2] * compared.frames

    def reduced(there: ComparedScene, missed: float) -> Prepared:
        one = prepared({}, partial(made.at, there, grid, missed))
        return one._replace(seconds=made.seconds + one.seconds)

    own = reduced(compared, grid["missed"])
    for count in counts:
        yield count * compared.frames, own, ""
    for missed in grid["tolerances"]:
        yield middle, reduced(compared, missed), f"tolerance={missed:g}"
    if other is not None:
        yield middle, Prepared({}, other, made.seconds + other.seconds), "place=another"
    elif lesson is not None and _places(lesson) and _places(lesson) != _places(compared):
        yield middle, reduced(lesson, grid["missed"]), "place=another"


def _places(compared: ComparedScene) -> list[dict]:
    """List the discs that are pushed."""
    return [{"at_m": push.at_m, "radius_m": push.radius_m} for push in compared.loads.pushes]
