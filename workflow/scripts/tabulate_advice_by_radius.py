from pathlib import Path

import pandas as pd

from palpate.benchmark.comparison import errors_from
from palpate.run.job import job, write_table
from palpate.studies.tradeoff.accuracy_vs_time import accuracy_vs_time
from palpate.studies.tradeoff.advice import advise
from palpate.studies.tradeoff.advice_agreement import by_radius
from palpate.studies.tradeoff.provenance import commit

with job(snakemake.log[0]):
    table = accuracy_vs_time(pd.concat([pd.read_csv(path) for path in snakemake.input.settings]), commit())
    errors, found = {path: Path(path).parts[-5:-3] for path in snakemake.input.errors}, []
    for (body, regime), settings in table.groupby(["body", "regime"], sort=False):
        families = [path for path, place in errors.items() if place == (body, regime)]
        found.append(advise(settings, errors_from(families, settings), **snakemake.params.limits))
    radii = {scene: tuple(place) for scene, place in snakemake.params.radii.items()}
    write_table(by_radius(pd.concat(found), radii), snakemake.output[0])
