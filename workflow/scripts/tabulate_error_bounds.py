from pathlib import Path

import pandas as pd

from palpate.benchmark.error_bounds import SAMPLES, Scene, error_bounds
from palpate.files import read_table
from palpate.run.job import job, write_table
from palpate.studies.tradeoff.error_estimates import read_estimates


def of(paths, body, regime):
    """The files of one body and regime, joined."""
    return [path for path in paths if Path(path).parts[-5:-3] == (body, regime)]


with job(snakemake.log[0]):
    given, scenes = snakemake.input, []
    for (body, regime), settings in pd.read_csv(given.table).groupby(["body", "regime"], sort=False):
        errors = pd.concat([read_table(path, SAMPLES)[SAMPLES] for path in of(given.errors, body, regime)])
        estimates = pd.concat([read_estimates(path) for path in of(given.estimates, body, regime)])
        scenes.append(Scene(settings, errors, estimates))
    write_table(error_bounds(scenes), snakemake.output[0])
