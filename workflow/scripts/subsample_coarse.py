from palpate.bodies.body_file import load
from palpate.job import job
from palpate.samples.static_responses import load_responses
from palpate.samples.subsampling import save_subsampled, subsample

with job(snakemake.log[0]):
    fine = load_responses(snakemake.input.fine)
    save_subsampled(fine.sample, subsample(load(snakemake.input.body), fine.displacement), snakemake.output[0])
