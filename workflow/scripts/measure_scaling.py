from palpate.run.job import use_threads

use_threads(snakemake.threads)  # this job runs alone

from palpate.run.job import job, powers, write_table
from palpate.studies.scaling.measure_scaling import doubling, measure

with job(snakemake.log[0]) as say:
    component = snakemake.wildcards.component
    # the component "cores" uses all cores; the others run on one
    sizes = snakemake.params.sizes or doubling(snakemake.threads)
    table = measure(component, sizes, lambda size: say(f"{component}: {size} done"))
    for row in table.drop_duplicates("stage").itertuples():
        said = powers({"time": row.seconds_exponent, "memory": row.memory_exponent})
        say(f"{row.stage}: {said or 'no growth to fit'}")
    write_table(table, snakemake.output[0])
