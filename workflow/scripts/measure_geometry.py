import pandas as pd

from palpate.benchmark.truth import load_truth
from palpate.bodies.body_file import load
from palpate.bodies.smooth_surface import surface_of
from palpate.run.job import job, steps, write_table
from palpate.studies.tradeoff.geometry import geometry_share

with job(snakemake.log[0]) as say:
    given, params = snakemake.input, snakemake.params
    body, truth, loads = load(given.body), load_truth(given.truth), pd.read_csv(given.loads)
    progress = steps(say, f"{body.name}, {snakemake.wildcards.regime}: what its facets change, solution")
    chosen = truth.spread(params.samples)
    write_table(geometry_share(body, surface_of(params.entry), loads, truth, chosen, progress), snakemake.output[0])
