from palpate.evaluation.shape_matching.integrator_stability import measure
from palpate.job import job, write_table

with job(snakemake.log[0]):
    write_table(measure(**snakemake.params.settings), snakemake.output[0])
