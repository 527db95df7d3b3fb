from pathlib import Path

from palpate.benchmark.split import read_samples, sample_peaks, split_counts
from palpate.run.job import job, write_table

with job(snakemake.log[0]):
    tables = {Path(path).parts[-3:-1]: read_samples(path) for path in snakemake.input.samples}
    write_table(sample_peaks(tables), snakemake.output.peaks)
    write_table(split_counts(tables), snakemake.output.splits)
