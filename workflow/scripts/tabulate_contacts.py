import pandas as pd

from palpate.run.job import job, write_table
from palpate.scenes import motion
from palpate.studies.scenes.measurements import contact_force

with job(snakemake.log[0]):
    motions = [motion.load(path) for path in snakemake.input.motions]
    write_table(pd.concat([m.contacts.assign(scene=m.scene) for m in motions]), snakemake.output.contacts)
    write_table(pd.concat([contact_force(m) for m in motions]), snakemake.output.force)
