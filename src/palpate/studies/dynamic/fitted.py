"""The models of a scene in motion and the settings that each is tried with; some are fitted to another motion."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from time import perf_counter
from typing import Any

import numpy as np
from scipy.optimize import minimize

from palpate.benchmark.comparable import LOADS
from palpate.benchmark.measuring import Prepared, prepared
from palpate.bodies.material import LAWS
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

Grid = Mapping[str, Any]
"""The values to try of the settings of one model, by the names of settings."""
Settings = Iterator[tuple[int, "Fitted | Prepared", str]]
"""Numbers of steps, what moves in them, and what of the setting is not the usual one, such as "tolerance=0.1"."""


@dataclass(frozen=True)
class Fitted:
    """A model whose parameters are known, which moves a body as a scene of its own.

    scene(compared, steps) : that scene; young_pa : the modulus of its particles; offline_s : time of the fit [s]
    finish : makes displacements (f, n_surface, 3) [m] of its motion; without it these are interpolated
    level : of the body that it moves, 0 is the coarse one, −1 the reference's
    """

    scene: Callable[[ComparedScene, int], Scene]
    young_pa: float
    offline_s: float
    finish: Callable[[Motion], np.ndarray] | None = None
    level: int = 0


def fit_springs(
    training: ComparedScene, wanted: np.ndarray, volume: bool, step_share: float, evaluations: int
) -> Fitted:
    """Fit ``logs`` to a training motion: of the springs' modulus, the dampers' ratio and, of sheets, the bending share.

    training, wanted : that motion, and its displacements (f, n_surface, 3) [m]
    volume : whether a volume force is added, whose stiffness follows from the Poisson ratio
    step_share : length of steps over the longest stable one; evaluations : most motions that are computed
    """
    begin, material = perf_counter(), training.body.material
    bulk = 0.0
    if volume:
        bulk = volume_stiffness(spring_model(particles_of(training.body, 0, surface=False)), material)

    def young_pa(logs: np.ndarray) -> float:
        return float(material.young_pa * np.exp(logs[0]))

    def scene(compared: ComparedScene, steps: int, logs: np.ndarray) -> Scene:
        stiffness = Springs()
        if compared.thickness_m:  # the modulus times the thickness [N/m], and a share of that against bending
            tension = compared.thickness_m * young_pa(logs)
            stiffness = Springs(structural_n_m=tension, shear_n_m=tension, bending_n_m=float(np.exp(logs[2])) * tension)
        return compared.springs(steps, stiffness, float(np.exp(logs[1])), bulk * young_pa(logs) / material.young_pa)

    def misfit(logs: np.ndarray) -> float:
        limit = training.limit_s(scene(training, training.frames, logs), young_pa(logs))
        return error_of(training, scene(training, training.steps(step_share * limit), logs), young_pa(logs), wanted)

    start, steps_of_start, bounds = [0.0, np.log(0.1)], [-0.4, 0.7], [(-2.3, 2.3), (-6.0, 1.0)]
    if training.thickness_m:
        start, steps_of_start, bounds = [*start, -4.0], [*steps_of_start, 1.5], [*bounds, (-9.0, 1.0)]
    logs = _simplex(misfit, np.array(start), steps_of_start, bounds, evaluations, f"{training.name}: no springs")
    return Fitted(lambda compared, steps: scene(compared, steps, logs), young_pa(logs), perf_counter() - begin)


def fit_shapes(training: ComparedScene, wanted: np.ndarray, per_frame: int, evaluations: int) -> Fitted:
    """Fit α, β, the decay of velocities and a scale of the loads to a training motion, in ``per_frame`` steps a frame.

    ``fitted`` : α, β, and logarithms of decay and scale, which is 1 where the body falls or meets an instrument. The
    stiffness α m/h² of masses m depends on the step h.
    """
    begin, young, steps = perf_counter(), training.body.material.young_pa, per_frame * training.frames
    clusters = cubes(training.body.coarse)
    scaled = training.held and not training.loads.contact

    def scene(compared: ComparedScene, steps: int, fitted: np.ndarray) -> Scene:
        matching = ShapeMatching(mode="linear", alpha=float(fitted[0]), beta=float(fitted[1]), clusters=clusters)
        loaded = compared.scale_loads(float(np.exp(fitted[3]))) if scaled else compared
        return loaded.shapes(steps, matching, float(np.exp(fitted[2])))

    def misfit(fitted: np.ndarray) -> float:
        return error_of(training, scene(training, steps, fitted), young, wanted)

    bounds, edges = [(0.02, 1.0), (0.0, 0.99), (-5.0, 7.0)], [0.25, 0.3, -1.0]
    starts = [np.array([alpha, beta, 1.6]) for alpha, beta in product((0.3, 0.9), (0.2, 0.7))]
    if scaled:
        bounds, edges = [*bounds, (-12.0, 12.0)], [*edges, 0.7]
        starts = [np.array([0.7, 0.4, 1.6, scale]) for scale in np.arange(-6.0, 6.1, 1.5)]
    fitted = _simplex(misfit, min(starts, key=misfit), edges, bounds, evaluations, f"{training.name}: no shapes")
    return Fitted(lambda compared, steps: scene(compared, steps, fitted), young, perf_counter() - begin)


def error_of(compared: ComparedScene, scene: Scene, young_pa: float, wanted: np.ndarray) -> float:
    """Return the RMSE of a motion over all frames and nodes over the peak of ``wanted`` (f, n_surface, 3) [m], or 1."""
    try:
        moved = compared.move(scene, 0, young_pa)[0]
    except (NotConverged, InputError):  # diverged, or its steps are too long: as wrong as no motion
        return 1.0
    rmse = np.sqrt(np.mean(np.sum((moved - wanted) ** 2, axis=2))) / np.linalg.norm(wanted, axis=2).max()
    return float(min(rmse, 1.0))


def _simplex(misfit: Callable, start: np.ndarray, edges: list, bounds: list, evaluations: int, what: str) -> np.ndarray:
    """Minimise ``misfit`` by Nelder and Mead from ``start`` and a step along each axis; NotConverged unless below 1."""
    corners = np.vstack([start, start + np.diag(edges)])
    options = {"maxfev": evaluations, "initial_simplex": corners, "xatol": 1e-3, "fatol": 1e-5}
    result = minimize(misfit, start, method="Nelder-Mead", bounds=bounds, options=options)
    if not result.fun < 1.0:
        raise NotConverged(f"{what} move like the reference; lower the loads", [])
    return result.x


def corrects(compared: ComparedScene) -> bool:
    """Return whether the correction applies: to a held solid of several levels under gravity and pushes alone."""
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
        finest = len(compared.body.levels) - 1
        (coarse, loads), (fine, fine_loads) = _responses(compared, 0), _responses(compared, finest)
        self.softness = float(np.vdot(fine_loads, fine) / np.vdot(loads, coarse))
        coarse = self.softness * coarse
        self._up = to_surface(compared.body, 0)
        fine_up = to_surface(compared.body, finest)
        self.detail = np.array([fine_up @ u - self._up @ c for u, c in zip(fine, coarse, strict=True)])
        masses = np.sqrt(np.repeat(compared.particles(0).masses, 3))
        self._shares = np.linalg.pinv((coarse.reshape(len(coarse), -1) * masses).T) * masses
        assert isinstance(compared.body.coarse, TetMesh)  # as ``corrects`` asks for
        self._rotations = NodalRotations(compared.body.coarse)

    def correct(self, motion: Motion) -> np.ndarray:
        """Return displacements (f, n_surface, 3) [m] of the fine surface after each frame of a coarse motion."""
        return np.array([self._corrected(x - motion.rest) for x in motion.positions[1:]])

    def _corrected(self, moved: np.ndarray) -> np.ndarray:
        """Return the fine surface (n_surface, 3) [m] of coarse displacements ``moved`` (n, 3) [m]: P x_c + R Σ a D."""
        turns = (self._up @ self._rotations.at(moved).reshape(-1, 9)).reshape(-1, 3, 3)
        detail = np.tensordot(self._shares @ moved.ravel(), self.detail, axes=1)
        return self._up @ moved + (turns @ detail[:, :, None])[:, :, 0]


def fit_correction(compared: ComparedScene) -> Fitted:
    """Prepare the correction of a compared scene; nothing is learnt, so no motion to fit to is needed."""
    begin = perf_counter()
    corrected = CorrectedMotion(compared)
    young = compared.body.material.young_pa / corrected.softness
    return Fitted(ComparedScene.fem, young, perf_counter() - begin, corrected.correct)


def _responses(compared: ComparedScene, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Return linear responses (k, n, 3) [m] of a level to each load at its full size, and the loads (k, n, 3) [N]."""
    particles, loads = compared.particles(level), []
    singles = [Loads(gravity=compared.loads.gravity)] if compared.loads.gravity else []
    singles += [Loads(push=Push(loads=[push])) for push in compared.loads.pushes]
    for single in (replace(compared, loads=each) for each in singles):
        system = compose(single.fem(single.frames), particles)
        for push in single.loads.pushes:
            system.at(push.start_s + push.press_s)
        no_velocity = np.zeros_like(particles.nodes)
        loads.append(system.outer_force(particles.nodes, no_velocity) + system.potential_force(particles.nodes))
    matrix = system.stiffness(particles.nodes, definite=True)
    assert matrix is not None  # finite elements have one
    system.hold(matrix)
    factor = Factor(matrix)
    return np.array([factor.solve(load) for load in loads]), np.array(loads)


@dataclass(frozen=True)
class MadeModes:
    """What modes for all places of a push share: the body at rest, and the time that it took [s]."""

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
    training: ComparedScene | None,
    grid: Mapping[str, Any],
    made: MadeModes | None = None,
    other: ReducedBody | None = None,
) -> Settings:
    """Yield settings of motions in modes for the pushes of ``compared``: number of steps, reduced body, what differs.

    All numbers of steps of the grid come first; then, with the middle one, cubature points that miss less or more of
    the force (``tolerances``), and modes for another place, that of ``training``, which show the error of a push that
    they are not for. Nothing is learnt from motions.
    made, other : the body at rest, and its modes for another place, if they are known; otherwise both are made here
    """
    made, counts = made or MadeModes.of(compared, grid), grid["steps_per_frame"]
    middle_steps = counts[len(counts) // 2] * compared.frames

    def reduced(there: ComparedScene, missed: float) -> Prepared:
        modes = prepared({}, partial(made.at, there, grid, missed))
        return modes._replace(seconds=made.seconds + modes.seconds)

    for_scene = reduced(compared, grid["missed"])
    for count in counts:
        yield count * compared.frames, for_scene, ""
    for missed in grid["tolerances"]:
        yield middle_steps, reduced(compared, missed), f"tolerance={missed:g}"
    if other is not None:
        yield middle_steps, Prepared({}, other, made.seconds + other.seconds), "place=another"
    elif training is not None and _places(training) and _places(training) != _places(compared):
        yield middle_steps, reduced(training, grid["missed"]), "place=another"


def _places(compared: ComparedScene) -> list[dict]:
    """List the discs that are pushed."""
    return [{"at_m": push.at_m, "radius_m": push.radius_m} for push in compared.loads.pushes]


def models_of(
    compared: ComparedScene, training: ComparedScene | None, wanted: np.ndarray, grid: Mapping[str, Grid], **made: Any
) -> dict[str, Callable[[], Settings]]:
    """Return, by name, the models that can simulate a scene, each as a function that prepares its settings.

    training, wanted : the motion that models are fitted to, and its displacements (g, n_surface, 3) [m]; without it
        those that need a fit are left out
    made : what ``moving_modes`` need not make
    Springs have no plasticity, those of a sheet no volume, and what relaxes elements one by one has the corotational
    law.
    """
    models: dict[str, Callable[[], Settings]] = {"fem_coarse": partial(_coarse, compared, grid["fem_coarse"])}
    if len(compared.body.levels) > 1:
        models["fem_fine"] = partial(_fine, compared, grid["fem_fine"])
    if compared.thickness_m or compared.body.material.law == LAWS[0]:
        models |= {name: partial(_relaxed, compared, name, each) for name, each in grid.get("relaxed", {}).items()}
    if corrects(compared):
        models["detail_correction"] = partial(_corrected, compared, grid["fem_coarse"])
        models["moving_modes"] = partial(moving_modes, compared, training, grid["moving_modes"], **made)
    if not training:
        return models
    fit_to = training, wanted
    if not compared.loads.plasticity:
        models["springs"] = partial(_springs, compared, *fit_to, False, grid["springs"])
        if not compared.thickness_m:
            models["springs_volume"] = partial(_springs, compared, *fit_to, True, grid["springs"])
    return models | {"shape_matching": partial(_shapes, compared, *fit_to, grid["shape_matching"])}


def _coarse(compared: ComparedScene, grid: Grid) -> Settings:
    """Yield steps of finite elements on the coarse level, then looser residuals and other gaps at the middle one."""
    counts, elements = grid["steps_per_frame"], Fitted(ComparedScene.fem, compared.body.material.young_pa, 0.0)
    if len(compared.body.levels) > 1:
        for count in counts:
            yield count * compared.frames, elements, ""
    middle = counts[len(counts) // 2] * compared.frames
    if compared.order > 1:
        yield middle, replace(elements, scene=partial(ComparedScene.fem, order=1)), "order=1"
    for loose in grid["tolerances"]:
        yield middle, replace(elements, scene=partial(_looser, loose)), f"tolerance={loose:g}"
    for factor in grid["gaps"] if compared.loads.contact else []:
        yield middle, replace(elements, scene=partial(_wider, factor)), f"gap={factor:g}×"


def _fine(compared: ComparedScene, grid: Grid) -> Settings:
    """Yield finite elements on the reference's level, at looser residuals than its own and by steps of first order.

    At its own residuals they need no run: the reference has tried these steps.
    """
    counts = grid["steps_per_frame"]
    elements = Fitted(ComparedScene.fem, compared.body.material.young_pa, 0.0, level=-1)
    for count, loose in product(counts, grid["tolerances"]):
        yield count * compared.frames, replace(elements, scene=partial(_looser, loose)), f"tolerance={loose:g}"
    if compared.order > 1:
        yield min(counts) * compared.frames, replace(elements, scene=partial(ComparedScene.fem, order=1)), "order=1"


def _corrected(compared: ComparedScene, grid: Grid) -> Settings:
    """Yield the steps of the coarse level whose motion is corrected."""
    fitted = fit_correction(compared)
    for count in grid["steps_per_frame"]:
        yield count * compared.frames, fitted, ""


def _relaxed(compared: ComparedScene, method: str, grid: Sequence[dict]) -> Settings:
    """Yield settings of a method that relaxes elements one by one, on levels that the body has."""
    for each in grid:
        setting = {name: value for name, value in each.items() if name not in ("level", "steps_per_frame")}
        if each["level"] < len(compared.body.levels):
            scene = partial(ComparedScene.relaxed, method=method, setting=setting)
            elements = Fitted(scene, compared.body.material.young_pa, 0.0, level=each["level"])
            said = " ".join(f"{name}={value}" for name, value in (setting | {"level": each["level"]}).items())
            yield each["steps_per_frame"] * compared.frames, elements, said


def _looser(tolerance: float, compared: ComparedScene, steps: int) -> Scene:
    return compared.fem(steps).model_copy(update={"tolerance": tolerance})  # looser than a scene may be


def _wider(factor: float, compared: ComparedScene, steps: int) -> Scene:
    return compared.widen(factor).fem(steps)


def _springs(
    compared: ComparedScene, training: ComparedScene, wanted: np.ndarray, volume: bool, grid: Grid
) -> Settings:
    """Yield numbers of steps of springs, which are fitted to ``wanted`` at the longest share of a stable step."""
    shares = grid["shares_of_stable_step"]
    fitted = fit_springs(training, wanted, volume, max(shares), grid["evaluations"])
    limit = compared.limit_s(fitted.scene(compared, compared.frames), fitted.young_pa)
    for share in shares:
        yield compared.steps(share * limit), fitted, ""


def _shapes(compared: ComparedScene, training: ComparedScene, wanted: np.ndarray, grid: Grid) -> Settings:
    """Yield steps of shape matching, which is fitted for each."""
    for count in grid["steps_per_frame"]:
        yield count * compared.frames, fit_shapes(training, wanted, count, grid["evaluations"]), ""
