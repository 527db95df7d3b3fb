from pathlib import Path

import pandas as pd

from palpate.bodies.body_file import load
from palpate.run.job import job, rarely, write_table
from palpate.studies.organ_springs import organ_fit
from palpate.studies.organ_springs.organ import mass_motion, organ, references

with job(snakemake.log[0]) as say:
    found = organ(load(snakemake.input.body), snakemake.params.settings)
    say(f"{found.body.name}: press it with finite elements")
    motions = references(found)
    errors, history = organ_fit.measure(
        found, motions, snakemake.params.seed, lambda method: rarely(say, f"{method}: how far, best fitness")
    )
    tables = {
        "organ_springs": pd.concat([errors, organ_fit.rivals(found, motions)]),
        "organ_history": history.assign(body=found.body.name),
        "mass_motion": mass_motion(found),
    }
    for path in snakemake.output:
        write_table(tables[Path(path).stem], path)
