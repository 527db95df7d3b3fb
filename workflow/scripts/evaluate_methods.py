import h5py
import pandas as pd

from palpate.benchmark.accuracy import accuracy_rows, predict
from palpate.benchmark.database import read
from palpate.benchmark.model import FitOptions
from palpate.benchmark.split import read_samples, sides
from palpate.files import write_whole
from palpate.models.enrichment.methods import build
from palpate.run.job import job, write_table
from palpate.solvers.compliance import load_compliance

with job(snakemake.log[0]), write_whole(snakemake.output.predictions) as path, h5py.File(path, "w") as file:
    db, compliance = read(snakemake.input.database), load_compliance(snakemake.input.compliance)
    labels, samples, tables = dict(snakemake.wildcards.items()), read_samples(snakemake.input.samples), []
    for protocol, split in snakemake.params.cases:
        options = FitOptions(**snakemake.params.regression, split=split, seed=snakemake.params.seed)
        train, test = sides(samples, split)
        methods = build(db, compliance, train, protocol, options)
        tables.append(accuracy_rows(db, methods, protocol, test, {**labels, "split": split}))
        for name in snakemake.params.shown:
            file[f"{protocol}/{split}/{name}/sample"] = test
            file[f"{protocol}/{split}/{name}/predicted"] = predict(db, methods[name], protocol, test)
    write_table(pd.concat(tables), snakemake.output.accuracy)
