import pandas as pd

from palpate.benchmark.truth import load_truth
from palpate.bodies.body_file import load
from palpate.run.job import job, steps, write_table
from palpate.studies.tradeoff.other_element import other_element

with job(snakemake.log[0]) as say:
    body, truth = load(snakemake.input.body), load_truth(snakemake.input.truth)
    chosen = truth.spread(snakemake.params.samples)
    progress = steps(say, f"{body.name}, {snakemake.wildcards.regime}: truth by linear elements, solution")
    write_table(other_element(body, pd.read_csv(snakemake.input.loads), truth, chosen, progress), snakemake.output[0])
