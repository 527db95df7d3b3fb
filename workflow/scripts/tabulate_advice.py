from pathlib import Path

import pandas as pd

from palpate.benchmark.comparison import errors_from
from palpate.run.job import job, write_table
from palpate.studies.tradeoff.advice import advise
from palpate.studies.tradeoff.advice_motion import advise_motion

with job(snakemake.log[0]):
    limits, found = snakemake.params.limits, []
    errors = {path: Path(path).parts[-5:-3] for path in snakemake.input.errors}
    for table in snakemake.input.table:
        for (body, regime), settings in pd.read_csv(table).groupby(["body", "regime"], sort=False):
            families = [path for path, place in errors.items() if place == (body, regime)]
            found.append(advise(settings, errors_from(families, settings), **limits))
    bounds = [table for path in snakemake.input.bounds for table in pd.read_csv(path).groupby("scene")]
    asked = limits | {"speeds": snakemake.params.speeds}
    for path in snakemake.input.motions:
        for scene, rows in pd.read_csv(path).groupby("scene", sort=False):
            found.append(advise_motion(rows, **asked, bounds=dict(bounds).get(scene)))
    write_table(pd.concat(found), snakemake.output[0])
