from palpate.run.job import job, write_table
from palpate.studies.shape_matching import cluster_goals, clustered_column, deformation_modes

with job(snakemake.log[0]):
    settings, tables = snakemake.params.settings, snakemake.output
    write_table(clustered_column.measure(**settings), tables.clusters)
    write_table(cluster_goals.measure(**settings), tables.goals)
    write_table(deformation_modes.measure(), tables.modes)
