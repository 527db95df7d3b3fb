import pandas as pd

from palpate.bodies.body_file import load
from palpate.job import job
from palpate.samples.assemble import assemble, digest
from palpate.samples.database import write
from palpate.samples.static_responses import load_responses
from palpate.samples.subsampling import load_subsampled

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
