from palpate.run.job import job, steps, write_table
from palpate.studies.hard_cases.declared import measure

family = snakemake.wildcards.family
with job(snakemake.log[0]) as say:
    table = measure(family, steps(say, f"hard cases of {family}:"))
    for row in table[~table["passed"]].itertuples():
        say(
            f"warning: {row.case} with {row.model} is {row.outcome}, declared {row.declared}: {row.value} {row.message}"
        )
    write_table(table, snakemake.output[0])
