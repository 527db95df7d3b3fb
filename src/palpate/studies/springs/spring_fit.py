"""Methods for spring parameters on paper 2's cube, fitted to one press and evaluated on all, and the least error."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd

from palpate.models.springs.cube_experiment import Experiment, Motion
from palpate.models.springs.descent import descend, descend_smoothly, value_and_gradient
from palpate.models.springs.evolution import Rules, cma_es, evolve
from palpate.models.springs.fitness import CLOSED, Fit, Fitness, uniform
from palpate.models.springs.spring_motion import SpringModel, simulate
from palpate.studies.springs.settings import Searches
from palpate.table_declaration import Table

SEEDED = ["genetic", "cma_es"]


def find(
    method: str,
    trial: Experiment,
    fitnesses: list[Fitness],
    searches: Searches,
    seed: int,
    checkpoint: Path | None = None,
    report: Callable[[int, float], None] = lambda count, best: None,
) -> tuple[SpringModel, Fit]:
    """Find the parameters by one of the methods of model_looks.FITS, and the model that they belong to.

    gradient_smooth regularises the differences of moduli; gradient_all is fitted to all presses and shows the accuracy
    that the model can reach when it sees them.
    fitnesses : of the presses, of which all but gradient_all use the first only
    searches : the config's limits: generations and population of the genetic algorithm, evaluations of the others
    """
    model, fitness, limits, nodes = trial.model, fitnesses[0], trial.limits, len(trial.model.masses)
    if method in CLOSED:
        begin = perf_counter()
        model, young = CLOSED[method](model, trial.particles.material)
        seconds = perf_counter() - begin
        scored = Fitness(model, fitness.press, fitness.settings, fitness.positions, fitness.velocities)
        value = float(scored(young[None])[0])
        return model, Fit(young, value, np.array([[0, seconds, value]]))
    if method == "genetic":
        rules = Rules(searches.population, limits, seed)
        return model, evolve(fitness, nodes, rules, searches.generations, checkpoint, report)
    if method == "cma_es":
        return model, cma_es(fitness, trial.start(), limits, searches.cma_es_evaluations, seed, report)
    if method == "uniform":
        fit = uniform(fitness, nodes, limits)
        return model, Fit(fit.young, fit.fitness, fit.history[-1:])
    if method == "gradient_smooth":
        return model, descend_smoothly(fitness, trial.start(), limits, searches.gradient_evaluations)
    chosen = fitnesses if method == "gradient_all" else [fitness]
    return model, descend(chosen, trial.start(), limits, searches.gradient_evaluations)[0]


SPRING_HISTORY = Table(
    "spring_history",
    "The best fitness so far in each generation or iteration of each search.",
    """
    method volume_force seed generation: a run, and how far it is
    evaluations seconds fitness: what it took [s], and the best so far [m]
    """,
)


SPRING_FIT = Table(
    "spring_fit",
    "The error of the spring network on each press after each method of finding its parameters.",
    """
    method volume_force seed press used_in_fit: a run, and a press that was fitted or not
    rmse_m rmse_of_peak: error of the key points over all steps [m], and over the largest displacement
    max_x_m max_y_m max_z_m: largest error along each axis [m]
    fitness generations evaluations seconds: of the search: its end [m], and what it took
    """,
)


SPRING_ERRORS = Table(
    "spring_errors",
    "The signed error of the point that moves most after every time step of each press, and the largest of all key "
    "points.",
    """
    method volume_force seed step: a run, and a step
    error_x_m error_y_m error_z_m: springs minus finite elements, of the key point that moves most [m]
    most_m zero_m: largest error of a key point along an axis, and that of no motion [m]
    press used_in_fit: a press that was fitted or not
    """,
)


def judge(
    trial: Experiment, model: SpringModel, young: np.ndarray, references: dict[str, Motion], used: list[str]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Evaluate errors of the key points, of presses of which ``used`` were fitted.

    Returns a row of SPRING_FIT a press, over all steps, and rows of SPRING_ERRORS (paper 2's figure 3), one a step.
    """
    rows, steps = [], []
    rest = trial.settings.keys.of(trial.model.nodes)
    for press, (positions, velocities) in references.items():
        error = simulate(model, young, trial.presses[press], trial.settings)[0] - positions
        rmse, moved = float(np.sqrt((error**2).sum(axis=2).mean())), np.linalg.norm(positions - rest, axis=2)
        scored = Fitness(model, trial.presses[press], trial.settings, positions, velocities)
        value = float(scored(young[None])[0])
        most = np.abs(error).max(axis=(0, 1))
        rows.append((press, press in used, rmse, rmse / float(moved.max()), *most, value))
        signed = pd.DataFrame(error[:, moved.max(axis=0).argmax()], columns=["error_x_m", "error_y_m", "error_z_m"])
        signed.insert(0, "step", np.arange(1, len(error) + 1))
        largest, zero = (np.abs(each).max(axis=(1, 2)) for each in (error, positions - rest))
        steps.append(signed.assign(most_m=largest, zero_m=zero, press=press, used_in_fit=press in used))
    names = "press used_in_fit rmse_m rmse_of_peak max_x_m max_y_m max_z_m fitness"
    return pd.DataFrame(rows, columns=names.split()), pd.concat(steps, ignore_index=True)


def tables(
    found: Experiment,
    method: str,
    volume_force: bool,
    references: dict[str, Motion],
    searches: Searches,
    runs: dict[int, Path],
    report: Callable[[int, int, float], None],
) -> dict[str, pd.DataFrame]:
    """Compute the method's part of spring_fit, spring_history and spring_errors, with one run for each seed.

    references : that of the fitted press first; runs : path of the genetic algorithm's checkpoint by seed
    report : called with seed, generation and best fitness
    """
    trial = found.with_volume(found.volume_n_m()) if volume_force else found
    fitnesses = [trial.fitness(press, references) for press in references]
    used = list(references) if method == "gradient_all" else [fitnesses[0].press.name]
    parts: dict[str, list[pd.DataFrame]] = {"spring_fit": [], "spring_history": [], "spring_errors": []}
    fitnesses[0](trial.start()[None])  # so that compilation is not timed
    value_and_gradient(fitnesses[0], trial.start(), trial.settings.volume_n_m)
    for seed, checkpoint in runs.items():
        model, fit = find(method, trial, fitnesses, searches, seed, checkpoint, partial(report, seed))
        # closed forms have a single row
        rises = pd.DataFrame(fit.history, columns=["evaluations", "seconds", "fitness"]).astype({"evaluations": int})
        rises.insert(0, "generation", np.arange(len(rises)))
        last = rises.iloc[-1]
        labels = {"method": method, "volume_force": volume_force, "seed": seed}
        judged, grown = judge(trial, model, fit.young, references, used)
        judged = judged.assign(
            generations=int(last["generation"]),
            evaluations=int(last["evaluations"]),
            seconds=last["seconds"],
            volume_n_m=trial.settings.volume_n_m,
        )
        if checkpoint:
            checkpoint.unlink(missing_ok=True)
        for name, table in zip(parts, (judged, rises, grown), strict=True):
            parts[name].append(table.assign(**labels)[[*labels, *table.columns]])
    return {name: pd.concat(found, ignore_index=True) for name, found in parts.items()}


INCOMPRESSIBLE = 0.49
"""Poisson ratio of the stiffest volume force that a fit may choose."""

SPRING_FLOOR = Table(
    "spring_floor",
    "The least error that springs reach on each press, by the Poisson ratio of the material that they imitate.",
    """
    poisson volume_force volume_n_m press: Poisson's ratio, whether with volume force, its stiffness [N/m], a press
    rmse_m rmse_of_peak: error of the key points [m], and over the largest displacement
    """,
)


def measure(found: Experiment, references: dict[str, Motion], stiffest_n_m: float, evaluations: int) -> pd.DataFrame:
    """Measure the rows of spring_floor.csv for one Poisson ratio: each press, without and with a volume force.

    stiffest_n_m : upper bound [N/m] of the volume force's stiffness, which is fitted together with the moduli
    The springs are fitted to all presses, so that the error is the least possible one and not that of a fit to one
    press.
    """
    fitnesses = [found.fitness(press, references) for press in references]
    alone, _ = descend(fitnesses, found.start(), found.limits, evaluations)
    # from the material's volume force, and from none with the best moduli without it: so a volume force cannot seem to
    # increase the error only because a descent ended too early
    ends = []
    for young, stiffness in ((found.start(), min(found.volume_n_m(), stiffest_n_m)), (alone.young, 0.0)):
        trial = found.with_volume(stiffness)
        fitnesses = [trial.fitness(press, references) for press in references]
        ends.append(descend(fitnesses, young, found.limits, evaluations, stiffest_n_m))
    fit, stiffness = max(ends, key=lambda end: end[0].fitness)
    cases = ((found, alone, False), (found.with_volume(stiffness), fit, True))
    tables = [
        judge(trial, found.model, fitted.young, references, list(references))[0].assign(
            volume_force=force, volume_n_m=trial.settings.volume_n_m, poisson=found.particles.material.poisson
        )
        for trial, fitted, force in cases
    ]
    names = " ".join(SPRING_FLOOR.columns) + " max_x_m max_y_m max_z_m fitness"
    return pd.concat(tables)[names.split()]
