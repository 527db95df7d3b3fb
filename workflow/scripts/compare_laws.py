from palpate.bodies.body_file import load
from palpate.run.job import job, steps, write_table
from palpate.studies.law.compare_laws import compare_laws, growing_presses

with job(snakemake.log[0], snakemake.output.warned) as say:
    body, params = load(snakemake.input.body), snakemake.params
    found = steps(say, f"{body.name}: forces of growing presses at contact")
    loads = growing_presses(body, params.contacts, params.depths, params.radius_m, found)
    pressed = steps(say, f"{body.name}: presses under each law, variant")
    write_table(compare_laws(body, loads, params.laws, params.poissons, pressed), snakemake.output.table)
