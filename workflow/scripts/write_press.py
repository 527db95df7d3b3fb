from pathlib import Path

from palpate.bodies.body_file import load
from palpate.press.page.compose import held_nodes, press_models
from palpate.press.page.page import write_pages
from palpate.press.portable.file import read
from palpate.run.job import job, write_table
from palpate.studies.press import coarse_answer
from palpate.studies.press.known_presses import known_presses, trial_presses
from palpate.studies.press.measure import measure

with job(snakemake.log[0]):
    files, params, body = snakemake.input, snakemake.params, load(snakemake.input.body)
    model, coarse = read(files.model), coarse_answer.load(files.coarse)
    known = known_presses(body, files.truths, files.loads, params.samples)
    trials = trial_presses(body, params.contacts, 0.5 * model.info["peak_m"])
    models = {"contact_modes": (params.contacts, model)} | ({"coarse": (0, coarse)} if coarse else {})
    paths = {"contact_modes": Path(files.model), "coarse": Path(files.coarse)}
    table = measure(body.name, models, known, trials, {name: p.stat().st_size / 1e6 for name, p in paths.items()})
    write_table(table, snakemake.output.table)
    shown = press_models(table, paths, known, model.info)
    write_pages(shown, body.name, held_nodes(body), snakemake.output.section, snakemake.output.page)
