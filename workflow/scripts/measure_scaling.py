import os

os.environ["NUMBA_NUM_THREADS"] = str(snakemake.threads)  # read when numba is imported: this job runs alone

from palpate.evaluation.scaling.measure_scaling import doubling, measure
from palpate.job import job, write_table

with job(snakemake.log[0]) as say:
    kernel = snakemake.wildcards.kernel
    # cores are as many as there are, and all else grows on one of them
    sizes = snakemake.params.sizes or doubling(snakemake.threads)
    table = measure(kernel, sizes, lambda size: say(f"{kernel}: {size} done"))
    for row in table.drop_duplicates("stage").itertuples():
        say(f"{row.stage}: time n^{row.seconds_exponent:.2f}, memory n^{row.memory_exponent:.2f}")
    write_table(table, snakemake.output[0])
