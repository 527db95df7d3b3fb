import pandas as pd

from palpate.benchmark.database import read
from palpate.benchmark.sample_table import read_samples, sides
from palpate.bodies.body_file import load
from palpate.models.enrichment.methods import build
from palpate.models.enrichment.training_samples import FitOptions
from palpate.run.job import job, write_table
from palpate.solvers.compliance import load_compliance
from palpate.studies.enrichment.timing import choose_samples, cost_table, solves, timing_table

with job(snakemake.log[0]):
    given, params, name = snakemake.input, snakemake.params, snakemake.wildcards.body
    body, db, compliance = load(given.body), read(given.database), load_compliance(given.compliance)
    train, test = sides(read_samples(given.samples), "samples")
    options = FitOptions(**params.regression, split="samples", seed=params.seed)
    methods = {protocol: build(db, compliance, train, protocol, options) for protocol in ("paper", "live")}
    samples, repeats, means = choose_samples(db.peaks, test), params.repeats, params.published_means
    loads = pd.read_csv(given.loads).iloc[samples]
    fine, coarse = (solves(body, level, loads, params.tolerance) for level in (len(body.levels) - 1, 0))
    write_table(timing_table(db, methods, fine, coarse, samples, name, repeats, means), snakemake.output.timing)
    write_table(cost_table(db, methods, coarse, samples, name, repeats), snakemake.output.cost)
