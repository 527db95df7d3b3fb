import pandas as pd

from palpate.bodies.body_file import load
from palpate.job import job, write_table
from palpate.samples.assemble import assemble, digest
from palpate.samples.database import write
from palpate.samples.press import load_responses

with job(snakemake.log[0]):
    fine = load_responses(snakemake.input.fine)
    coarse = load_responses([snakemake.input.coarse])
    db = assemble(
        load(snakemake.input.body),
        pd.read_csv(snakemake.input.loads),
        fine.displacement,
        coarse.displacement,
        fine.residual,
        digest(snakemake.params.settings),
    )
    write(db, snakemake.output.database)
    peaks = pd.DataFrame({**dict(snakemake.wildcards.items()), "sample": fine.sample, "peak_m": db.peaks})
    write_table(peaks, snakemake.output.peaks)
