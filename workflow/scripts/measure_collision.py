from palpate.run.job import job, write_table
from palpate.studies.collision.compare_trees import installed, measure

with job(snakemake.log[0]) as say:
    for package in installed()[1]:
        say(f"{package} is not installed, so its rows are left out")
    params = snakemake.params
    table = measure(**params.settings, seed=params.seed, report=lambda scene: say(f"{scene} is done"))
    for row in table.itertuples():
        say(
            f"{row.scene} {row.structure} {row.depths}: frame {row.frame_ms:.3f} ms, query {row.query_ms:.3f} ms, "
            f"{row.missed_pairs} pairs missed, {row.extra_pairs} made up"
        )
    write_table(table, snakemake.output[0])
