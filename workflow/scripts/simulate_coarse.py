import pandas as pd

from palpate.benchmark.static_responses import press, save_responses
from palpate.bodies.body_file import load
from palpate.run.job import job, steps

with job(snakemake.log[0]) as say:
    body = load(snakemake.input.body)
    progress = steps(say, f"{body.name}, {snakemake.wildcards.regime}: coarse sample")
    responses = press(body, 0, pd.read_csv(snakemake.input.loads), snakemake.params.tolerance, progress)
    save_responses(responses, snakemake.output[0])
