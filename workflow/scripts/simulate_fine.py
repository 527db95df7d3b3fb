import pandas as pd

from palpate.benchmark.static_responses import press, save_responses
from palpate.bodies.body_file import load
from palpate.run.job import job, steps

with job(snakemake.log[0]) as say:
    body = load(snakemake.input.body)
    loads = pd.read_csv(snakemake.input.loads)
    size, batch = snakemake.params.samples_per_job, int(snakemake.wildcards.batch)
    loads = loads.iloc[batch * size : (batch + 1) * size]
    progress = steps(say, f"{body.name}, {snakemake.wildcards.regime}, batch {batch}: fine sample")
    finest = len(body.levels) - 1
    asked = snakemake.params.tolerance, progress, snakemake.params.order
    save_responses(press(body, finest, loads, *asked), snakemake.output[0])
