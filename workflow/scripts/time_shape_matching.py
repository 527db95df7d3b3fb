from palpate.run.job import job, write_table
from palpate.studies.shape_matching.shape_matching_timing import exponents, headline, measure, rotation_speedup

with job(snakemake.log[0]) as say:
    table = measure(**snakemake.params.settings)
    fits = ", ".join(f"{row.mode} {row.clusters}: {row.exponent:.3f}" for row in exponents(table).itertuples())
    say(f"100 objects of 100 particles in 8 quadratic clusters: {headline(table):.3f} ms a step")
    say(f"exponents of the cost in particles: {fits}")
    say(f"rotations are found {rotation_speedup():.1f} times faster than by numpy.linalg.svd")
    write_table(table, snakemake.output[0])
