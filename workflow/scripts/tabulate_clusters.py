from palpate.run.job import job, write_table
from palpate.studies.shape_matching import clusters

with job(snakemake.log[0]):
    settings, tables = snakemake.params.settings, snakemake.output
    write_table(clusters.clustered_column(**settings), tables.clusters)
    write_table(clusters.cluster_goals(**settings), tables.goals)
    write_table(clusters.deformation_modes(), tables.modes)
