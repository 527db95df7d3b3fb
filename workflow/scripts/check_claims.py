import pandas as pd

from palpate.bodies.store import load
from palpate.evaluation.claims import claims
from palpate.job import job, write_table

with job(snakemake.log[0]):
    names = ("accuracy", "sweep", "complexity", "timing")
    tables = [pd.read_csv(snakemake.input[name]) for name in names]
    size_m = {body.name: body.coarse.size for body in map(load, snakemake.input.bodies)}
    write_table(claims(*tables, size_m), snakemake.output[0])
