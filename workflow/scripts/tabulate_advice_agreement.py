import pandas as pd

from palpate.evaluation.tradeoff.advice_agreement import agreement
from palpate.job import job, write_table

with job(snakemake.log[0]):
    scenes = {scene: tuple(place) for scene, place in snakemake.params.scenes.items()}
    write_table(agreement(pd.read_csv(snakemake.input[0]), scenes), snakemake.output[0])
