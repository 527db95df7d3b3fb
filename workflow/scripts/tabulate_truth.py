import pandas as pd

from palpate.benchmark.truth import load_truth
from palpate.run.job import job, write_table
from palpate.studies.tradeoff.truth_table import truth_table

with job(snakemake.log[0]):
    scenes, given = snakemake.params.scenes, snakemake.input
    truths = dict(zip(scenes, map(load_truth, given.truths), strict=True))
    checks = dict(zip(scenes, map(pd.read_csv, given.checks), strict=True)) if given.get("checks") else None
    shares = dict(zip(snakemake.params.smooth, map(pd.read_csv, given.geometry), strict=True))
    write_table(truth_table(truths, checks, shares), snakemake.output[0])
