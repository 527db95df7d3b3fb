import pandas as pd

from palpate.benchmark.split import asked_samples, read_folds, training_presses
from palpate.benchmark.truth import save_truth, truth_of
from palpate.bodies.body_file import load
from palpate.run.job import job, steps

with job(snakemake.log[0], snakemake.output.warned) as say:
    body, params = load(snakemake.input.body), snakemake.params
    folds = read_folds(snakemake.input.samples)
    asked, tested = asked_samples(folds, params.splits)
    loads = pd.read_csv(snakemake.input.loads)
    progress = steps(say, f"{body.name}, {snakemake.wildcards.regime}: truth, solution")
    more = training_presses(folds, params.splits[0]) if params.more else []
    chosen = loads[loads["sample"].isin([*asked, *more])]
    save_truth(truth_of(body, chosen, set(tested), progress, params.tolerance), snakemake.output.truth)
