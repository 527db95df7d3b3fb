"""Fit springs and shape matching to how a scene moves under a share of its loads."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from scipy.optimize import minimize

from palpate.bodies.particles import particles_of
from palpate.calibration.closed_forms import volume_stiffness
from palpate.calibration.spring_model import spring_model
from palpate.errors import InputError, NotConverged
from palpate.evaluation.dynamic.dynamic_reference import Reference
from palpate.evaluation.dynamic.dynamic_trial import Trial
from palpate.models.shape_statics import cubes
from palpate.scenes.scene import Scene


@dataclass(frozen=True)
class Fitted:
    """A model with its parameters found: ``scene(trial, steps)``, the modulus for its particles, what the fit took."""

    scene: Callable[[Trial, int], Scene]
    young_pa: float
    offline_s: float


def fit_springs(trial: Trial, truth: Reference, volume: bool, step_share: float, evaluations: int) -> Fitted:
    """Fit one modulus and the dampers' ratio to the training motion of ``truth``, in so many motions at most.

    volume : with the volume force that the Poisson ratio calls for
    step_share : of the longest stable step, at which it is fitted
    """
    begin, given = perf_counter(), trial.body.material
    particles = particles_of(trial.body, 0, surface=False)
    bulk = volume_stiffness(spring_model(particles), given) if volume else 0.0

    def scene(trial: Trial, steps: int, young: float, ratio: float) -> Scene:
        return trial.springs(steps, ratio, bulk * young / given.young_pa)

    quiet = trial.scale_loads(truth.training_share)

    def misfit(q: np.ndarray) -> float:
        young, ratio = given.young_pa * np.exp(q[0]), float(np.exp(q[1]))
        limit = quiet.limit_s(scene(quiet, quiet.frames, young, ratio), young)
        return error_of(quiet, scene(quiet, quiet.steps(step_share * limit), young, ratio), young, truth.training)

    bounds = [(-2.3, 2.3), (-6.0, 1.0)]
    q = _simplex(misfit, np.array([0.0, np.log(0.1)]), [-0.4, 0.7], bounds, evaluations, f"{trial.name}: no springs")
    young, ratio = float(given.young_pa * np.exp(q[0])), float(np.exp(q[1]))
    return Fitted(lambda trial, steps: scene(trial, steps, young, ratio), young, perf_counter() - begin)


def fit_shapes(trial: Trial, truth: Reference, steps: int, evaluations: int) -> Fitted:
    """Fit α, β, the scale of the loads and the decay of velocities, for so many steps: α m/h² depends on them."""
    begin, young = perf_counter(), trial.body.material.young_pa
    clusters = cubes(trial.body.coarse)

    def scene(trial: Trial, steps: int, q: np.ndarray) -> Scene:
        matching = {"mode": "linear", "alpha": float(q[0]), "beta": float(q[1]), "clusters": clusters}
        return trial.scale_loads(float(np.exp(q[2]))).shapes(steps, matching, float(np.exp(q[3])))

    quiet = trial.scale_loads(truth.training_share)

    def misfit(q: np.ndarray) -> float:
        return error_of(quiet, scene(quiet, steps, q), young, truth.training)

    starts = [np.array([0.7, 0.4, scale, 1.6]) for scale in np.arange(-6.0, 6.1, 1.5)]
    bounds = [(0.02, 1.0), (0.0, 0.99), (-12.0, 12.0), (-3.0, 7.0)]
    start, sides = min(starts, key=misfit), [0.25, 0.3, 0.7, -1.0]
    q = _simplex(misfit, start, sides, bounds, evaluations, f"{trial.name}: no shapes")
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
