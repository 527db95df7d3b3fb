import pandas as pd

from palpate.benchmark.assemble import assemble, digest
from palpate.benchmark.database import write
from palpate.benchmark.static_responses import load_responses
from palpate.benchmark.subsampling import load_subsampled
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
