from pathlib import Path

from palpate.job import job
from palpate.report.page import write

with job(snakemake.log[0]):
    out, params = Path(snakemake.output[0]), snakemake.params
    write(out.parent, Path(snakemake.input.paper).parent, out, params.parts, params.scenes, params.cts, params.driven)
