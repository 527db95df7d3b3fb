"""Fit springs and shape matching to how a scene moves at another place, or under a share of its loads."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from time import perf_counter

import numpy as np
from scipy.optimize import minimize

from palpate.bodies.particles import particles_of
from palpate.errors import InputError, NotConverged
from palpate.models.shape_matching import cubes
from palpate.models.springs.fitness import volume_stiffness
from palpate.models.springs.spring_motion import spring_model
from palpate.scenes.motion import Motion
from palpate.scenes.scene import Scene
from palpate.studies.dynamic.dynamic_trial import Trial


@dataclass(frozen=True)
class Fitted:
    """A model with its parameters found: ``scene(trial, steps)``, the modulus for its particles, what the fit took.

    finish : what makes displacements (f, n_surface, 3) [m] of its motion, if interpolation does not
    level : which it moves, 0 is the coarse one, −1 the reference's
    """

    scene: Callable[[Trial, int], Scene]
    young_pa: float
    offline_s: float
    finish: Callable[[Motion], np.ndarray] | None = None
    level: int = 0


def fit_springs(lesson: Trial, wanted: np.ndarray, volume: bool, step_share: float, evaluations: int) -> Fitted:
    """Fit a modulus, the dampers' ratio and a sheet's bending springs, in so many motions at most.

    lesson, wanted : the motion to fit, and its displacements (f, n_surface, 3) [m]
    volume : with the volume force that the Poisson ratio calls for
    step_share : of the longest stable step, at which it is fitted
    """
    begin, given = perf_counter(), lesson.body.material
    bulk = 0.0
    if volume:
        bulk = volume_stiffness(spring_model(particles_of(lesson.body, 0, surface=False)), given)

    def scene(trial: Trial, steps: int, q: np.ndarray) -> Scene:
        young = float(given.young_pa * np.exp(q[0]))
        stiffness = _of_sheet(trial.thickness_m * young, float(np.exp(q[2]))) if trial.thickness_m else {}
        return trial.springs(steps, stiffness, float(np.exp(q[1])), bulk * young / given.young_pa)

    def misfit(q: np.ndarray) -> float:
        young = float(given.young_pa * np.exp(q[0]))
        limit = lesson.limit_s(scene(lesson, lesson.frames, q), young)
        return error_of(lesson, scene(lesson, lesson.steps(step_share * limit), q), young, wanted)

    start, sides, bounds = [0.0, np.log(0.1)], [-0.4, 0.7], [(-2.3, 2.3), (-6.0, 1.0)]
    if lesson.thickness_m:
        start, sides, bounds = [*start, -4.0], [*sides, 1.5], [*bounds, (-9.0, 1.0)]
    q = _simplex(misfit, np.array(start), sides, bounds, evaluations, f"{lesson.name}: no springs")
    young = float(given.young_pa * np.exp(q[0]))
    return Fitted(lambda trial, steps: scene(trial, steps, q), young, perf_counter() - begin)


def _of_sheet(along: float, bending: float) -> dict:
    """Return the springs of a sheet: its modulus times its thickness [N/m], and a share of that against bending."""
    return {"structural_n_m": along, "shear_n_m": along, "bending_n_m": bending * along}


def fit_shapes(lesson: Trial, wanted: np.ndarray, per_frame: int, evaluations: int) -> Fitted:
    """Fit α, β, the decay of velocities and the scale of the loads, for so many steps a frame: α m/h² depends on them.

    Where the body falls or is met by an instrument, loads are what they are.
    """
    begin, young, steps = perf_counter(), lesson.body.material.young_pa, per_frame * lesson.frames
    clusters = cubes(lesson.body.coarse)
    scaled = lesson.held and "contact" not in lesson.loads

    def scene(trial: Trial, steps: int, q: np.ndarray) -> Scene:
        matching = {"mode": "linear", "alpha": float(q[0]), "beta": float(q[1]), "clusters": clusters}
        return (trial.scale_loads(float(np.exp(q[3]))) if scaled else trial).shapes(
            steps, matching, float(np.exp(q[2]))
        )

    def misfit(q: np.ndarray) -> float:
        return error_of(lesson, scene(lesson, steps, q), young, wanted)

    bounds, sides = [(0.02, 1.0), (0.0, 0.99), (-5.0, 7.0)], [0.25, 0.3, -1.0]
    starts = [np.array([alpha, beta, 1.6]) for alpha, beta in product((0.3, 0.9), (0.2, 0.7))]
    if scaled:
        bounds, sides = [*bounds, (-12.0, 12.0)], [*sides, 0.7]
        starts = [np.array([0.7, 0.4, 1.6, scale]) for scale in np.arange(-6.0, 6.1, 1.5)]
    q = _simplex(misfit, min(starts, key=misfit), sides, bounds, evaluations, f"{lesson.name}: no shapes")
    return Fitted(lambda trial, steps: scene(trial, steps, q), young, perf_counter() - begin)


def error_of(trial: Trial, scene: Scene, young_pa: float, wanted: np.ndarray) -> float:
    """Return the RMSE of a motion over all frames and nodes over the peak of ``wanted`` (f, n_surface, 3) [m], or 1."""
    try:
        moved = trial.move(scene, 0, young_pa)[0]
    except (NotConverged, InputError):  # diverged, or its steps are too long: as wrong as no motion
        return 1.0
    rmse = np.sqrt(np.mean(np.sum((moved - wanted) ** 2, axis=2))) / np.linalg.norm(wanted, axis=2).max()
    return float(min(rmse, 1.0))


def _simplex(
    misfit: Callable[[np.ndarray], float],
    start: np.ndarray,
    sides: list[float],
    bounds: Sequence[tuple[float, float]],
    evaluations: int,
    what: str,
) -> np.ndarray:
    corners = np.vstack([start, start + np.diag(sides)])
    options = {"maxfev": evaluations, "initial_simplex": corners, "xatol": 1e-3, "fatol": 1e-5}
    found = minimize(misfit, start, method="Nelder-Mead", bounds=bounds, options=options)
    if not found.fun < 1.0:
        raise NotConverged(f"{what} move like the reference; lower the loads", [])
    return found.x
