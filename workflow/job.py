from palpate.job import call

call(snakemake)
