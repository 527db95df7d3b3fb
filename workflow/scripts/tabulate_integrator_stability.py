from palpate.run.job import job, write_table
from palpate.studies.shape_matching.integrator_stability import measure

with job(snakemake.log[0]):
    write_table(measure(**snakemake.params.settings), snakemake.output[0])
