import pandas as pd

from palpate.job import job, write_table
from palpate.scenes import motion

with job(snakemake.log[0]):
    inputs, out = snakemake.input, snakemake.output
    write_table(pd.concat([pd.read_csv(path) for path in inputs.decisions]), out.decisions)
    costs = pd.concat([pd.read_csv(path) for path in inputs.costs])
    errors = pd.concat([pd.read_csv(path) for path in inputs.errors])
    write_table(costs.merge(errors, on=["scene", "effect"], how="left"), out.effects)
    energies = {found.scene: found.energy for found in map(motion.load, inputs.motions)}
    write_table(pd.concat(energies, names=["scene", "frame"]).reset_index("scene"), out.energy)
