import pandas as pd

from palpate.benchmark.database import write
from palpate.benchmark.static_responses import assemble, digest, load_responses, load_subsampled
from palpate.bodies.body_file import load
from palpate.run.job import job

with job(snakemake.log[0]):
    given = snakemake.input
    db = assemble(
        load(given.body),
        pd.read_csv(given.loads),
        load_responses(given.fine),
        load_subsampled(given.paper),
        load_responses([given.live]),
        digest(snakemake.params.settings),
    )
    write(db, snakemake.output[0])
