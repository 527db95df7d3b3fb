from pathlib import Path

from palpate.report.page import write
from palpate.run.job import job
from palpate.run.kept_warnings import load

with job(snakemake.log[0]):
    out, params = Path(snakemake.output[0]), snakemake.params
    warned = load(snakemake.input.warned)
    write(out.parent, out, params.studies, params.scenes, params.cts, params.driven, warned, params.more)
