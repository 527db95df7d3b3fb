from pathlib import Path

import yaml

from palpate.figures import sigma_sweep, style, tables
from palpate.job import job, stem

with job(snakemake.log[0]):
    paper = yaml.safe_load(Path(snakemake.input.paper).read_text(encoding="utf-8"))
    sweep, accuracy = tables.read(snakemake.input.sweep), tables.read(snakemake.input.accuracy)
    style.save(sigma_sweep.draw(sweep, accuracy, paper), stem(snakemake.output))
