from palpate.run.job import job
from palpate.scenes.motion import load, write_series

with job(snakemake.log[0]):
    write_series(load(snakemake.input.motion), snakemake.output[0])
