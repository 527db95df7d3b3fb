from palpate.run.job import job, steps, write_table
from palpate.studies.palpation.palpation_limits import palpation_limits

with job(snakemake.log[0]) as say:
    progress = steps(say, "a finger above a ball at depth")
    write_table(palpation_limits(**snakemake.params.settings, progress=progress), snakemake.output[0])
