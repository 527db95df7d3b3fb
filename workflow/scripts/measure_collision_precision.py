from palpate.run.job import job, write_table
from palpate.studies.collision import apart_bodies, stopped_precision

with job(snakemake.log[0]) as say:
    params, size = snakemake.params, {"refinements": snakemake.params.refinements}
    found = stopped_precision.measure(**params.stopped, **size, report=lambda scene: say(f"{scene} is done"))
    write_table(found, snakemake.output.precision)
    more = {"depths": params.depths, "seed": params.seed}
    found = apart_bodies.measure(**params.apart, **size, **more, report=lambda pair: say(f"{pair} apart is done"))
    write_table(found, snakemake.output.apart)
