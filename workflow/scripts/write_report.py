from pathlib import Path

from palpate.job import job
from palpate.report.page import write

with job(snakemake.log[0]):
    out, params = Path(snakemake.output[0]), snakemake.params
    captions = Path(snakemake.scriptdir).parent / "report"
    write(out.parent, captions, out, params.studies, params.scenes, params.cts, params.driven)
