import pandas as pd

from palpate.run.job import job, write_table
from palpate.scenes import motion
from palpate.studies.scenes.measurements import energy_balance

with job(snakemake.log[0]):
    inputs, out = snakemake.input, snakemake.output
    write_table(pd.concat([pd.read_csv(path) for path in inputs.decisions]), out.decisions)
    costs = pd.concat([pd.read_csv(path) for path in inputs.costs])
    errors = pd.concat([pd.read_csv(path) for path in inputs.errors])
    write_table(costs.merge(errors, on=["scene", "effect"], how="left"), out.effects)
    energies = {found.scene: found.energy for found in map(motion.load, inputs.motions)}
    energy = pd.concat(energies, names=["scene", "frame"]).reset_index("scene")
    write_table(energy, out.energy)
    write_table(energy_balance(energy, snakemake.params.integrators), out.balance)
