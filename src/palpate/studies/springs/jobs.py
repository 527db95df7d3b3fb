"""Functions that the rules of workflow/rules/springs.smk call; palpate.studies.common_jobs says how."""

from pathlib import Path

from palpate.run.job import rarely, steps, write_table
from palpate.studies.springs.settings import Searches, Settings


def simulate_spring_reference(output, calibration: Settings, poisson: float):
    from palpate.models.springs.cube_experiment import experiment, save_references, simulate_references

    found = experiment(calibration, poisson)
    save_references(simulate_references(found, calibration.substeps), output[0])


def fit_springs(input, output, wildcards, say, calibration: Settings, searches: Searches, seed: int):
    from palpate.models.springs.cube_experiment import experiment, load_references
    from palpate.models.springs.searches import SEEDED
    from palpate.studies.springs.spring_fit import tables

    method = wildcards.method
    seeds = range(seed, seed + (searches.seeds if method in SEEDED else 1))
    references = load_references(input.reference)
    for force in ("springs", "volume"):
        found = tables(
            experiment(calibration, calibration.material.poisson), method, force == "volume", references,
            searches, seeds, rarely(say, f"{method}, {force}: seed, generation, best fitness"),
        )  # fmt: skip
        for path in output[force]:
            write_table(found[Path(path).stem], path)


def measure_spring_floor(say, calibration: Settings, poissons: list[float], evaluations: int):
    import pandas as pd

    from palpate.models.springs.cube_experiment import experiment, simulate_references
    from palpate.studies.springs.spring_fit import INCOMPRESSIBLE, measure

    stiffest, floors = experiment(calibration, INCOMPRESSIBLE).volume_n_m(), []
    for poisson in steps(say, "springs' floor: Poisson's ratio")(poissons):
        found = experiment(calibration, poisson)
        floors.append(measure(found, simulate_references(found, calibration.substeps), stiffest, evaluations))
    return pd.concat(floors)
