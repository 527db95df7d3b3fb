from pathlib import Path

from palpate.figures.report import write
from palpate.job import job

with job(snakemake.log[0]):
    out = Path(snakemake.output[0])
    write(out.parent, Path(snakemake.input.paper).parent, out)
