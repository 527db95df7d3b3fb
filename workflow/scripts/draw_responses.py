from palpate.benchmark.database import read
from palpate.bodies.body_file import load
from palpate.report import style
from palpate.run.job import job, stem
from palpate.studies.enrichment.figures import deformed_bodies, error_over_body, predictions, turnable_errors

with job(snakemake.log[0]):
    body, db, path = load(snakemake.input.body), read(snakemake.input.database), snakemake.input.predictions
    shown = predictions.read(path, "paper", "samples", deformed_bodies.METHODS)
    style.save(deformed_bodies.draw(body, db, shown), stem(snakemake.output.deformed))
    groups = {
        f"{protocol} protocol, {split} held out": predictions.read(path, protocol, split, error_over_body.METHODS)
        for protocol, split in (("paper", "samples"), ("live", "contacts"))
    }
    style.save(error_over_body.draw(body, db, groups), stem(snakemake.output.errors))
    turnable_errors.write(db, groups["live protocol, contacts held out"], snakemake.output.turnable)
