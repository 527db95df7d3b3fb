from pathlib import Path

from palpate.figures.report import write
from palpate.job import job

with job(snakemake.log[0]):
    out, params = Path(snakemake.output[0]), snakemake.params
    write(out.parent, Path(snakemake.input.paper).parent, out, params.parts, params.scenes, params.cts, params.driven)
