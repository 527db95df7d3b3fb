from palpate.run.job import call

call(snakemake)
