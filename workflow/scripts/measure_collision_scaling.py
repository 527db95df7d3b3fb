import math

from palpate.evaluation.collision.collision_growth import exponents
from palpate.evaluation.collision.collision_scaling import measure
from palpate.job import job, write_table

with job(snakemake.log[0]) as say:
    params = snakemake.params
    table = measure(params.triangles, params.depths, lambda number: say(f"{number} triangles are done"))
    for row in exponents(table).itertuples():
        stages = {"build": row.build_ms, "refit": row.refit_ms, "query": row.query_ms}
        powers = ", ".join(f"{stage} n^{power:.2f}" for stage, power in stages.items() if math.isfinite(power))
        say(f"{row.structure} {row.depths}: {powers}")
    write_table(table, snakemake.output[0])
