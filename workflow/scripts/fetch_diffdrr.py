from pathlib import Path

from palpate.bodies.ct.example import fetch
from palpate.run.job import job

with job(snakemake.log[0]) as say:
    say(fetch(Path(snakemake.output[0])))
