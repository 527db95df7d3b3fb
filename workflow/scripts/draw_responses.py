from palpate.benchmark.database import read
from palpate.bodies.body_file import load
from palpate.report import style
from palpate.run.job import job, stem
from palpate.studies.enrichment.figures import bodies

with job(snakemake.log[0]):
    body, db, path = load(snakemake.input.body), read(snakemake.input.database), snakemake.input.predictions
    shown = bodies.read(path, "paper", "samples", bodies.METHODS_DEFORMED_BODIES)
    style.save(bodies.draw_deformed_bodies(body, db, shown), stem(snakemake.output.deformed))
    groups = {
        f"{protocol} protocol, {split} held out": bodies.read(path, protocol, split, bodies.METHODS_ERROR_OVER_BODY)
        for protocol, split in (("paper", "samples"), ("live", "contacts"))
    }
    style.save(bodies.draw_error_over_body(body, db, groups), stem(snakemake.output.errors))
    bodies.write(db, groups["live protocol, contacts held out"], snakemake.output.turnable)
