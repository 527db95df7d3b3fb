from palpate.run.job import use_threads

use_threads(snakemake.threads)

from pathlib import Path

from palpate.run.job import job, rarely, write_table
from palpate.studies.springs.spring_experiment import experiment, load_references
from palpate.studies.springs.spring_fit import SEEDED, budget, tables

with job(snakemake.log[0]) as say:
    calibration, method = snakemake.params.calibration, snakemake.wildcards.method
    volume, seed = snakemake.wildcards.force == "volume", snakemake.params.seed
    seeds = range(seed, seed + (snakemake.params.searches["seeds"] if method in SEEDED else 1))
    folder = Path(snakemake.output[0]).parent
    found = experiment(calibration, calibration["material"]["poisson"])
    found_tables = tables(
        found, method, volume, load_references(snakemake.input.reference), budget(snakemake.params.searches),
        {one: folder / f"state_{one}.npz" for one in seeds}, rarely(say, f"{method}: seed, generation, best fitness"),
    )  # fmt: skip
    for path in snakemake.output:
        write_table(found_tables[Path(path).stem], path)
