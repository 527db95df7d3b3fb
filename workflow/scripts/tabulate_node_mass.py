import pandas as pd

from palpate.bodies.ct.mesh_from_ct import segment_entry
from palpate.evaluation.ct.node_mass import measure
from palpate.job import job, steps, write_table

with job(snakemake.log[0]) as say:
    entries, settings = snakemake.params.entries, snakemake.params.settings
    tables = [
        measure(body, *segment_entry(entry), **settings, progress=steps(say, f"{body}: node masses, resolution"))
        for body, entry in entries.items()
    ]
    write_table(pd.concat(tables), snakemake.output[0])
