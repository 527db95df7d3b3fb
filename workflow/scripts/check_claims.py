import pandas as pd

from palpate.evaluation.enrichment.enrichment_claims import claims
from palpate.files import read_yaml
from palpate.job import job, write_table

with job(snakemake.log[0]):
    names = ("accuracy", "sweep", "complexity", "timing")
    tables = [pd.read_csv(snakemake.input[name]) for name in names]
    write_table(claims(*tables, read_yaml(snakemake.input.paper)), snakemake.output[0])
