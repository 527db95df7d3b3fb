"""Fit the springs of an organ to some presses by every method, and test them and their rivals at other contacts."""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from palpate.bodies import body_file
from palpate.effects import shape_matching
from palpate.effects.held import Held
from palpate.effects.settings import ShapeMatching
from palpate.effects.velocity_damping import VelocityDamping
from palpate.errors import NotConverged
from palpate.models.shape_matching import cubes
from palpate.models.springs.fitness import CLOSED
from palpate.models.springs.searches import SEEDED, find
from palpate.models.springs.spring_motion import Load, Settings, SpringModel, reference_motion, simulate
from palpate.run.job import rarely
from palpate.solvers.goal_position import GoalPosition
from palpate.solvers.system import System
from palpate.studies.organ_springs.organ import Organ, Reference, deviation, mass_motion, organ, references
from palpate.studies.organ_springs.settings import Settings as OrganSettings
from palpate.table_declaration import Table

METHODS = (*CLOSED, "uniform", "genetic", "cma_es", "gradient")
"""Methods that determine moduli, in the order of tables."""
Report = Callable[[int, float], None]

ORGAN_HISTORY = Table(
    "organ_history",
    "The best fitness so far in each generation or iteration of each search for an organ's springs.",
    """
    evaluations seconds fitness: what it took [s], and the best so far [m]
    model volume_force seed generation body: a run, and how far it is
    """,
)


def measure(
    pressed: Organ, references: list[Reference], seed: int, report: Callable[[str], Report]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compute the rows of organ_springs.csv and organ_history.csv of springs by all METHODS.

    seed : the first of ``searches.seeds`` consecutive ones; report : from a method to what receives its progress
    """
    errors, histories, material = [], [], pressed.particles(0).material
    young = np.full(len(pressed.model.masses), float(material.young_pa))
    for volume_force in pressed.settings.volume_force:
        settings = pressed.spring_settings(volume_force)
        fitnesses = pressed.fitnesses(settings, references)
        softest = np.full(len(pressed.model.masses), pressed.limits.low_pa)
        fitnesses[0](softest[None])  # so that compilation is not timed
        simulate(pressed.model, softest, pressed.press(0, 0), settings)
        seeds = range(seed, seed + pressed.settings.searches.seeds)
        runs = [(method, run_seed) for method in METHODS for run_seed in (seeds if method in SEEDED else seeds[:1])]
        for method, run_seed in runs:
            model, fit = find(
                method, fitnesses, material, young, pressed.limits, pressed.settings.searches, run_seed, report(method)
            )
            labels = {"model": method, "volume_force": volume_force, "seed": run_seed}
            judged = judge(pressed, model, fit.young, settings, references)
            judged["offline_s"], judged["evaluations"] = fit.history[-1, 1], int(fit.history[-1, 0])
            errors.append(judged.assign(**labels))
            history = pd.DataFrame(fit.history, columns=["evaluations", "seconds", "fitness"])
            histories.append(history.assign(**labels, generation=np.arange(len(history))))
    return pd.concat(errors, ignore_index=True), pd.concat(histories, ignore_index=True)


def judge(
    pressed: Organ, model: SpringModel, young: np.ndarray, settings: Settings, references: list[Reference]
) -> pd.DataFrame:
    """Measure the error and time of springs with moduli ``young`` (n,) [Pa] at every contact, one row each."""

    def move(number: int) -> np.ndarray:
        return simulate(model, young, pressed.press(number, 0), settings)[0]

    return judge_motions(pressed, move, references).assign(step_s=settings.step_s)


ORGAN_SPRINGS = Table(
    "organ_springs",
    "The error of an organ's springs, however fitted, and of rivals at each contact, and what a second of motion "
    "takes them.",
    """
    body contact used_in_fit: a body, and a contact that was fitted or not
    rmse_m peak_m rmse_of_peak: error over frames and key points, largest displacement [m], and their ratio
    reference_error: of the reference's shorter step / peak
    ms_a_second step_s: time of computing a second of motion [ms], and the step [s]
    offline_s evaluations: what the search took
    model volume_force seed: a model and its run
    """,
)


def judge_motions(pressed: Organ, move: Callable[[int], np.ndarray], references: list[Reference]) -> pd.DataFrame:
    """Measure the error and time of a model at every contact, in the first columns of ORGAN_SPRINGS.

    move : from a contact's number to positions of key points (f, p, 3) [m]; f divides the number of frames, and errors
        are those at the ends of the f frames
    """
    rest, rows = pressed.keys.of(pressed.body.coarse.nodes), []
    for number, (expected, _, reference_error) in enumerate(references):
        start = perf_counter()
        motion = move(number)
        taken_s = perf_counter() - start
        stride = len(expected) // len(motion)
        rmse = float(np.sqrt(((motion - expected[stride - 1 :: stride]) ** 2).sum(axis=2).mean()))
        peak = float(np.linalg.norm(expected - rest, axis=2).max())
        columns = rmse, peak, rmse / peak, reference_error, 1e3 * taken_s / pressed.settings.duration_s
        rows.append((pressed.body.name, int(pressed.contacts[number]), number < pressed.fitted, *columns))
    names = "body contact used_in_fit rmse_m peak_m rmse_of_peak reference_error ms_a_second"
    return pd.DataFrame(rows, columns=names.split())


def rivals(pressed: Organ, references: list[Reference]) -> pd.DataFrame:
    """Compute the rows of organ_springs.csv of rest, of coarse finite elements and of shape matching."""
    rest = pressed.keys.of(pressed.body.coarse.nodes)
    zero = judge_motions(pressed, lambda number: rest[None], references)
    tables = [zero.assign(model="zero", step_s=pressed.settings.duration_s, offline_s=0.0)]
    tables += [_fem(pressed, frames_a_step, references) for frames_a_step in pressed.settings.fem_frames]
    tables += [_shapes(pressed, steps, references) for steps in pressed.settings.shape_steps]
    return pd.concat(tables, ignore_index=True).assign(volume_force=False, evaluations=0, seed=0)


def _fem(pressed: Organ, frames_a_step: int, references: list[Reference]) -> pd.DataFrame:
    """Measure linear elements on the coarse mesh, with one implicit step in ``frames_a_step`` frames."""
    particles, frames = pressed.particles(0), pressed.settings.frames // frames_a_step
    step_a_frame = pressed.in_steps(1)
    settings = replace(step_a_frame, step_s=step_a_frame.step_s * frames_a_step, steps=frames)

    def move(number: int) -> np.ndarray:
        return reference_motion(particles, pressed.model, pressed.press(number, 0), settings, 1)[0]

    move(0)  # so that compilation is not timed
    table = judge_motions(pressed, move, references)
    return table.assign(model="coarse_fem", step_s=settings.step_s, offline_s=0.0)


def _shapes(pressed: Organ, steps: int, references: list[Reference]) -> pd.DataFrame:
    """Measure shape matching, its force factor, β and decay fitted to the fitted presses, with ``steps`` in a frame."""
    began = perf_counter()
    rest = pressed.keys.of(pressed.body.coarse.nodes)

    def misfit(unknowns: np.ndarray) -> float:
        move = _shape_motion(pressed, steps, unknowns)
        try:
            errors = [min(deviation(move(i), x, rest), 1.0) for i, (x, _, _) in enumerate(references[: pressed.fitted])]
        except NotConverged:
            return 1.0
        return float(np.mean(errors))

    starts = [np.array([scale, 0.5, 2.0]) for scale in np.arange(-6.0, 6.1, 1.5)]
    start = min(starts, key=misfit)
    simplex = np.vstack([start, start + np.diag([0.7, 0.3, -1.0])])
    options = {"maxfev": pressed.settings.shape_evaluations, "initial_simplex": simplex}
    bounds = [(-14.0, 14.0), (0.0, 0.99), (-3.0, 7.0)]
    fitted = minimize(misfit, start, method="Nelder-Mead", bounds=bounds, options=options).x
    taken_s = perf_counter() - began
    table = judge_motions(pressed, _shape_motion(pressed, steps, fitted), references)
    return table.assign(model="shape_matching", step_s=pressed.in_steps(steps).step_s, offline_s=taken_s)


def _shape_motion(pressed: Organ, steps: int, unknowns: np.ndarray) -> Callable[[int], np.ndarray]:
    """Return the function from a contact's number to the motion (f, p, 3) [m] of shape matching, ``steps`` a frame.

    unknowns : logarithm of the factor of forces, β, and logarithm of the decay of velocities [1/s]
    """
    factor, beta, rate = float(np.exp(unknowns[0])), float(unknowns[1]), float(np.exp(unknowns[2]))
    particles = replace(pressed.particles(0), regions=None)  # shapes have one stiffness
    clusters, settings = cubes(pressed.body.coarse), pressed.in_steps(steps)
    shapes = shape_matching.make(particles, ShapeMatching(alpha=1.0, beta=beta, clusters=clusters))
    damping, held = VelocityDamping(particles.masses, rate), Held(particles.held)

    def move(number: int) -> np.ndarray:
        press = pressed.press(number, 0)
        load = Load(replace(press, force_n=factor * press.force_n))
        system = System(particles, {"shape_matching": shapes, "held": held, "push": load, "damping": damping})
        integrator, motion = GoalPosition(system, shapes.alpha), [particles.nodes]
        x, v = particles.nodes, np.zeros_like(particles.nodes)
        for load.factor in press.factors(settings.step_s, settings.steps):
            x, v = integrator.step(x, v, settings.step_s)
            motion.append(x)
        return settings.compared(np.array(motion))

    return move


def fit_organ_springs(input: Any, say: Callable, settings: OrganSettings, seed: int) -> dict[str, pd.DataFrame]:
    """Fit the springs of one organ, and measure their rivals, for the rule of this name."""
    pressed = organ(body_file.load(input.body), settings)
    say(f"{pressed.body.name}: press it with finite elements")
    motions = references(pressed)
    errors, history = measure(pressed, motions, seed, lambda method: rarely(say, f"{method}: how far, best fitness"))
    return {
        "organ_springs": pd.concat([errors, rivals(pressed, motions)]),
        "organ_history": history.assign(body=pressed.body.name),
        "mass_motion": mass_motion(pressed),
    }
