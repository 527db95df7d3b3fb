from palpate.run.job import job, powers, write_table
from palpate.studies.collision.compare_trees import exponents, measure_growth

with job(snakemake.log[0]) as say:
    params = snakemake.params
    table = measure_growth(params.triangles, params.depths, lambda number: say(f"{number} triangles are done"))
    for row in exponents(table).itertuples():
        said = powers({"build": row.build_ms, "refit": row.refit_ms, "query": row.query_ms})
        say(f"{row.structure} {row.depths}: {said}")
    write_table(table, snakemake.output[0])
