"""Rivals of an organ's springs: no motion, coarse finite elements, and shape matching."""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from palpate.effects import shape_matching
from palpate.effects.held import Held
from palpate.effects.velocity_damping import VelocityDamping
from palpate.errors import NotConverged
from palpate.models.shape_matching import cubes
from palpate.models.springs.spring_motion import Load, reference_motion
from palpate.solvers.goal_position import GoalPosition
from palpate.solvers.system import System
from palpate.studies.organ_springs.organ import Organ, Reference, deviation
from palpate.studies.organ_springs.organ_fit import judge_motions


def measure(found: Organ, references: list[Reference]) -> pd.DataFrame:
    """Compute the rows of organ_springs.csv of all rivals."""
    rest = found.keys.of(found.body.coarse.nodes)
    zero = judge_motions(found, lambda number: rest[None], references)
    tables = [zero.assign(model="zero", step_s=found.settings["duration_s"], offline_s=0.0)]
    for share in found.settings["fem_frames"]:
        tables.append(_fem(found, share, references))
    for steps in found.settings["shape_steps"]:
        tables.append(_shapes(found, steps, references))
    return pd.concat(tables, ignore_index=True).assign(volume_force=False, evaluations=0, seed=0)


def _fem(found: Organ, every: int, references: list[Reference]) -> pd.DataFrame:
    """Measure coarse linear elements, one implicit step in ``every`` frames."""
    particles, frames = found.particles(0), found.settings["frames"] // every
    once = found.in_steps(1)
    settings = replace(once, step_s=once.step_s * every, steps=frames)

    def move(number: int) -> np.ndarray:
        return reference_motion(particles, found.model, found.press(number, 0), settings, 1)[0]

    move(0)  # so that compilation is not timed
    table = judge_motions(found, move, references)
    return table.assign(model="coarse_fem", step_s=settings.step_s, offline_s=0.0)


def _shapes(found: Organ, steps: int, references: list[Reference]) -> pd.DataFrame:
    """Fit how strongly forces act, β, and the decay of velocities to the fitted presses, and measure them all."""
    begin = perf_counter()
    rest = found.keys.of(found.body.coarse.nodes)

    def misfit(unknowns: np.ndarray) -> float:
        move = _shape_motion(found, steps, unknowns)
        try:
            errors = [min(deviation(move(i), x, rest), 1.0) for i, (x, _, _) in enumerate(references[: found.fitted])]
        except NotConverged:
            return 1.0
        return float(np.mean(errors))

    starts = [np.array([scale, 0.5, 2.0]) for scale in np.arange(-6.0, 6.1, 1.5)]
    start = min(starts, key=misfit)
    corners = np.vstack([start, start + np.diag([0.7, 0.3, -1.0])])
    options = {"maxfev": found.settings["shape_evaluations"], "initial_simplex": corners}
    bounds = [(-14.0, 14.0), (0.0, 0.99), (-3.0, 7.0)]
    best = minimize(misfit, start, method="Nelder-Mead", bounds=bounds, options=options).x
    taken = perf_counter() - begin
    table = judge_motions(found, _shape_motion(found, steps, best), references)
    return table.assign(model="shape_matching", step_s=found.in_steps(steps).step_s, offline_s=taken)


def _shape_motion(found: Organ, steps: int, unknowns: np.ndarray) -> Callable[[int], np.ndarray]:
    """Return how shapes move, in ``steps`` in each frame, for the logarithm of forces' factor, β, and of the decay."""
    factor, beta, rate = float(np.exp(unknowns[0])), float(unknowns[1]), float(np.exp(unknowns[2]))
    particles = replace(found.particles(0), regions=None)  # shapes have one stiffness
    clusters, settings = cubes(found.body.coarse), found.in_steps(steps)
    shapes = shape_matching.make(particles, {"mode": "linear", "alpha": 1.0, "beta": beta, "clusters": clusters})
    damping, held = VelocityDamping(particles.masses, rate), Held(particles.held)

    def move(number: int) -> np.ndarray:
        press = found.press(number, 0)
        load = Load(replace(press, force_n=factor * press.force_n))
        system = System(particles, {"shape_matching": shapes, "held": held, "push": load, "damping": damping})
        integrator, motion = GoalPosition(system, shapes.alpha), [particles.nodes]
        x, v = particles.nodes, np.zeros_like(particles.nodes)
        for load.factor in press.factors(settings.step_s, settings.steps):
            x, v = integrator.step(x, v, settings.step_s)
            motion.append(x)
        return settings.compared(np.array(motion))

    return move
