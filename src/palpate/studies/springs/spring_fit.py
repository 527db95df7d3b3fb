"""Fit the springs of paper 2's cube to one press by every method, evaluate them on all, and find the least error."""

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.models.springs import cube_experiment
from palpate.models.springs.cube_experiment import Experiment, Motion, experiment, simulate_references
from palpate.models.springs.descent import descend, value_and_gradient
from palpate.models.springs.searches import SEEDED, find
from palpate.models.springs.spring_motion import SpringModel, simulate
from palpate.run.job import rarely, steps, write_table
from palpate.studies.springs.settings import Searches, Settings
from palpate.table_declaration import Table

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
    cube: Experiment, model: SpringModel, young: np.ndarray, references: dict[str, Motion], used: list[str]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compare the motion of springs at the key points with ``references`` of all presses; ``used`` names fitted ones.

    young : moduli (n,) [Pa] of the nodes
    Returns a row of SPRING_FIT a press, over all steps, and rows of SPRING_ERRORS (paper 2's figure 3), one a step.
    """
    rows, by_step = [], []
    rest = cube.settings.keys.of(cube.model.nodes)
    for press, (positions, _) in references.items():
        error = simulate(model, young, cube.presses[press], cube.settings)[0] - positions
        rmse, moved_m = float(np.sqrt((error**2).sum(axis=2).mean())), np.linalg.norm(positions - rest, axis=2)
        fitness = float(cube.fitness(press, references).of(model)(young[None])[0])
        largest_by_axis = np.abs(error).max(axis=(0, 1))
        rows.append((press, press in used, rmse, rmse / float(moved_m.max()), *largest_by_axis, fitness))
        signed = pd.DataFrame(error[:, moved_m.max(axis=0).argmax()], columns=["error_x_m", "error_y_m", "error_z_m"])
        signed.insert(0, "step", np.arange(1, len(error) + 1))
        largest, zero = (np.abs(each).max(axis=(1, 2)) for each in (error, positions - rest))
        by_step.append(signed.assign(most_m=largest, zero_m=zero, press=press, used_in_fit=press in used))
    names = "press used_in_fit rmse_m rmse_of_peak max_x_m max_y_m max_z_m fitness"
    return pd.DataFrame(rows, columns=names.split()), pd.concat(by_step, ignore_index=True)


def tables(
    cube: Experiment,
    method: str,
    volume_force: bool,
    references: dict[str, Motion],
    searches: Searches,
    seeds: Iterable[int],
    report: Callable[[int, int, float], None],
) -> dict[str, pd.DataFrame]:
    """Compute a method's rows of spring_fit, spring_history and spring_errors, by table, with one run for each seed.

    references : by press, that of the fitted press first; the method gradient_all is fitted to all of them, to show the
        accuracy that springs can reach
    report : called with seed, generation and best fitness
    """
    trial = cube.with_volume(cube.volume_n_m()) if volume_force else cube
    fitnesses = [trial.fitness(press, references) for press in references]
    fitted = fitnesses if method == "gradient_all" else fitnesses[:1]
    fitted_presses = [each.press.name for each in fitted]
    tables_of_runs: dict[str, list[pd.DataFrame]] = {"spring_fit": [], "spring_history": [], "spring_errors": []}
    fitnesses[0](trial.start()[None])  # so that compilation is not timed
    value_and_gradient(fitnesses[0], trial.start(), trial.settings.volume_n_m)
    for seed in seeds:
        limits, material = trial.limits, trial.particles.material
        model, fit = find(method, fitted, material, trial.start(), limits, searches, seed, partial(report, seed))
        history = fit.history[-1:] if method == "uniform" else fit.history  # one modulus has no search worth a curve
        rises = pd.DataFrame(history, columns=["evaluations", "seconds", "fitness"]).astype({"evaluations": int})
        rises.insert(0, "generation", np.arange(len(rises)))
        last_row = rises.iloc[-1]
        labels = {"method": method, "volume_force": volume_force, "seed": seed}
        judged, errors_by_step = judge(trial, model, fit.young, references, fitted_presses)
        judged = judged.assign(
            generations=int(last_row["generation"]),
            evaluations=int(last_row["evaluations"]),
            seconds=last_row["seconds"],
            volume_n_m=trial.settings.volume_n_m,
        )
        for name, table in zip(tables_of_runs, (judged, rises, errors_by_step), strict=True):
            tables_of_runs[name].append(table.assign(**labels)[[*labels, *table.columns]])
    return {name: pd.concat(runs, ignore_index=True) for name, runs in tables_of_runs.items()}


INCOMPRESSIBLE = 0.49
"""Poisson's ratio of the material whose volume force is the stiffest that a fit may choose."""

SPRING_FLOOR = Table(
    "spring_floor",
    "The least error that springs reach on each press, by the Poisson ratio of the material that they imitate.",
    """
    poisson volume_force volume_n_m press: Poisson's ratio, whether with volume force, its stiffness [N/m], a press
    rmse_m rmse_of_peak: error of the key points [m], and over the largest displacement
    """,
)


def measure(cube: Experiment, references: dict[str, Motion], stiffest_n_m: float, evaluations: int) -> pd.DataFrame:
    """Measure the rows of spring_floor.csv for one Poisson's ratio: each press, without and with a volume force.

    stiffest_n_m : upper bound [N/m] of the volume force's stiffness, which is fitted together with the moduli
    The springs are fitted to all presses at once, so that their error is the least possible.
    """
    fitnesses = [cube.fitness(press, references) for press in references]
    springs_alone, _ = descend(fitnesses, cube.start(), cube.limits, evaluations)
    # from the material's volume force, and from none with the best moduli without it: so a volume force cannot seem to
    # increase the error only because a descent ended too early
    volume_fits = []
    for young, stiffness in ((cube.start(), min(cube.volume_n_m(), stiffest_n_m)), (springs_alone.young, 0.0)):
        trial = cube.with_volume(stiffness)
        fitnesses = [trial.fitness(press, references) for press in references]
        volume_fits.append(descend(fitnesses, young, cube.limits, evaluations, stiffest_n_m))
    best_fit, stiffness = max(volume_fits, key=lambda end: end[0].fitness)
    rows = []
    for trial, fitted, volume_force in ((cube, springs_alone, False), (cube.with_volume(stiffness), best_fit, True)):
        judged = judge(trial, cube.model, fitted.young, references, list(references))[0]
        labels = {"volume_n_m": trial.settings.volume_n_m, "poisson": cube.particles.material.poisson}
        rows.append(judged.assign(volume_force=volume_force, **labels))
    names = " ".join(SPRING_FLOOR.columns) + " max_x_m max_y_m max_z_m fitness"
    return pd.concat(rows)[names.split()]


def simulate_spring_reference(output: Any, calibration: Settings, poisson: float) -> None:
    """Simulate all presses of the cube with finite elements, for the rule of this name."""
    references = simulate_references(experiment(calibration, poisson), calibration.substeps)
    cube_experiment.save_references(references, output[0])


def fit_springs(
    input: Any, output: Any, wildcards: Any, say: Callable, calibration: Settings, searches: Searches, seed: int
) -> None:
    """Fit springs by one method, without and with a volume force, for the rule of this name."""
    method, references = wildcards.method, cube_experiment.load_references(input.reference)
    seeds = range(seed, seed + (searches.seeds if method in SEEDED else 1))
    for forces in ("springs", "volume"):
        cube = experiment(calibration, calibration.material.poisson)
        report = rarely(say, f"{method}, {forces}: seed, generation, best fitness")
        computed = tables(cube, method, forces == "volume", references, searches, seeds, report)
        for path in output[forces]:
            write_table(computed[Path(path).stem], path)


def measure_spring_floor(say: Callable, calibration: Settings, poissons: list[float], evaluations: int) -> pd.DataFrame:
    """Measure the least error of springs for several Poisson's ratios, for the rule of this name."""
    stiffest, floors = experiment(calibration, INCOMPRESSIBLE).volume_n_m(), []
    for poisson in steps(say, "springs' floor: Poisson's ratio")(poissons):
        cube = experiment(calibration, poisson)
        floors.append(measure(cube, simulate_references(cube, calibration.substeps), stiffest, evaluations))
    return pd.concat(floors)
