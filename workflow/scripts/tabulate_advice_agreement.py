import pandas as pd

from palpate.run.job import job, write_table
from palpate.studies.tradeoff.advice_agreement import agreement

with job(snakemake.log[0]):
    scenes = {scene: tuple(place) for scene, place in snakemake.params.scenes.items()}
    write_table(agreement(pd.read_csv(snakemake.input[0]), scenes), snakemake.output[0])
