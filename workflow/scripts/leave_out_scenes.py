import warnings

from palpate.run.job import job

with job(snakemake.log[0], snakemake.output[0]):
    for name, reason in snakemake.params.reasons.items():
        warnings.warn(f"scenes.{name}: models are not compared in it, as it {reason}.", stacklevel=1)
