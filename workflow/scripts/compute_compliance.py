from palpate.bodies.body_file import load
from palpate.job import job, steps
from palpate.solvers.compliance import compute_compliance, save_compliance

with job(snakemake.log[0]) as say:
    body = load(snakemake.input.body)
    progress = steps(say, f"{body.name}: unit forces at contact")
    compliance = compute_compliance(body, float(snakemake.wildcards.radius), progress, snakemake.params.contacts)
    save_compliance(compliance, snakemake.output[0])
