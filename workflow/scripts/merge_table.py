from pathlib import Path

from palpate.files import write_whole
from palpate.run.job import job

with job(snakemake.log[0]), write_whole(snakemake.output[0]) as path:
    parts = [Path(part).read_text().splitlines(keepends=True) for part in snakemake.input]
    path.write_text("".join([parts[0][0], *(line for part in parts for line in part[1:])]))
