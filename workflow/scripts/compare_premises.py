from palpate.benchmark.database import read
from palpate.models.enrichment.training_samples import FitOptions
from palpate.run.job import job, steps, write_table
from palpate.studies.enrichment.premises import Settings, compare

with job(snakemake.log[0], snakemake.output.warned) as say:
    params = snakemake.params
    options = FitOptions(**params.regression, split="contacts", seed=params.seed)
    settings = Settings(**params.settings, options=options)
    databases = {name: read(path) for name, path in zip(params.sampled, snakemake.input.databases, strict=True)}
    tables = compare(params.cases, params.bodies, databases, settings, steps(say, "premise"))
    for name, table in tables.items():
        write_table(table, snakemake.output[name])
