from pathlib import Path

from palpate.job import job
from palpate.kept_warnings import load
from palpate.report.page import write

with job(snakemake.log[0]):
    out, params = Path(snakemake.output[0]), snakemake.params
    captions, warned = Path(snakemake.scriptdir).parent / "report", load(snakemake.input.warned)
    write(out.parent, captions, out, params.studies, params.scenes, params.cts, params.driven, warned, params.more)
