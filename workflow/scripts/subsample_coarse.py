from palpate.benchmark.static_responses import load_responses, save_subsampled, subsample
from palpate.bodies.body_file import load
from palpate.run.job import job

with job(snakemake.log[0]):
    fine = load_responses(snakemake.input.fine)
    save_subsampled(fine.sample, subsample(load(snakemake.input.body), fine.displacement), snakemake.output[0])
