import pandas as pd

from palpate.bodies.ct.mesh_from_ct import segment_entry
from palpate.run.job import job, steps, write_table
from palpate.run.kept_warnings import about
from palpate.studies.ct.node_mass import measure

with job(snakemake.log[0]) as say:
    entries, sizes = snakemake.params.entries, snakemake.params.sizes
    tables = []
    for body, entry in entries.items():
        with about(f"bodies.{body}"):
            image, mask = segment_entry(entry)
        tables.append(measure(body, image, mask, sizes, progress=steps(say, f"{body}: node masses, resolution")))
    write_table(pd.concat(tables), snakemake.output[0])
