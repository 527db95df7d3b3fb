import pandas as pd

from palpate.job import job, write_table
from palpate.samples.split import split

with job(snakemake.log[0]):
    loads = pd.read_csv(snakemake.input.loads)
    parts, counts, params = loads[["sample", "contact"]].copy(), [], snakemake.params
    for kind in ("samples", "contacts"):
        _, test = split(parts["contact"].to_numpy(), params.train, params.test, kind, params.seed)
        parts[kind] = "train"
        parts.loc[test, kind] = "test"
        counts.append({**dict(snakemake.wildcards.items()), "split": kind, "train": params.train, "test": params.test})
    write_table(parts, snakemake.output.parts)
    write_table(pd.DataFrame(counts), snakemake.output.counts)
