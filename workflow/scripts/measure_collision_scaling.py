from palpate.evaluation.collision.collision_growth import exponents
from palpate.evaluation.collision.collision_scaling import measure
from palpate.job import job, write_table

with job(snakemake.log[0]) as say:
    params = snakemake.params
    table = measure(params.triangles, params.depths, lambda number: say(f"{number} triangles are done"))
    for row in exponents(table).itertuples():
        powers = f"build n^{row.build_ms:.2f}, refit n^{row.refit_ms:.2f}, query n^{row.query_ms:.2f}"
        say(f"{row.structure} {row.depths}: {powers}")
    write_table(table, snakemake.output[0])
