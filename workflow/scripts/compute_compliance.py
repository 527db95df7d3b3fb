from palpate.bodies.body_file import load
from palpate.bodies.contacts import kept_contacts
from palpate.run.job import job, steps
from palpate.solvers.compliance import compute_compliance, save_compliance

with job(snakemake.log[0]) as say:
    body = load(snakemake.input.body)
    progress = steps(say, f"{body.name}: unit forces at contact")
    radius, params = float(snakemake.wildcards.radius), snakemake.params
    compliance = compute_compliance(body, radius, progress, kept_contacts(body, params.contacts), params.order)
    save_compliance(compliance, snakemake.output[0])
