from palpate.bodies.body_file import load
from palpate.run.job import job, steps
from palpate.studies.press.coarse_answer import coarse_answer, save
from palpate.studies.press.prepared import export

with job(snakemake.log[0]) as say:
    body, params = load(snakemake.input.body), snakemake.params
    save(coarse_answer(body, params.radius_m), snakemake.output.coarse)
    rest = params.radius_m, params.grid, params.seed, params.tolerance
    export(body, params.settings, *rest, snakemake.output.model, lambda what: steps(say, f"{body.name}: {what}"))
