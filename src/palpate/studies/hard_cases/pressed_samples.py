"""Simulated samples of a small body, on which methods of enrichment are tested."""

from dataclasses import replace
from functools import cache

import numpy as np

from palpate.benchmark.database import Database, database_of
from palpate.benchmark.model import FitOptions
from palpate.bodies.body import Body, nest
from palpate.bodies.box import box
from palpate.effects.patch_load import nodal_load
from palpate.models.enrichment.features import FEATURES, kinds
from palpate.models.enrichment.fitting import Training
from palpate.models.enrichment.methods import METHODS as REGISTERED
from palpate.models.enrichment.methods import build
from palpate.models.enrichment.paper_enrichment import WEIGHTS, Blend, DescribedSamples
from palpate.solvers.compliance import Compliance, compute_compliance
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.hard_cases.stage import SOFT

NEIGHBOURS, CONTACTS, TRAIN = 6, 8, 12
SETTINGS = FitOptions(NEIGHBOURS, {"min": 0.01, "max": 100, "count": 7}, 3, "contacts", 1)
BLENDS = tuple(f"{features}_{weights}" for features in FEATURES for weights in WEIGHTS)
METHODS = tuple(REGISTERED)
PHYSICAL = ("linear_fem", "detail_correction_unturned", "detail_correction_untaught")


@cache
def pressed() -> tuple[Body, Database, Compliance]:
    """Simulate a bar of 0.2 m, held at one end and pressed at CONTACTS contacts with 0.02 and 0.04 N.

    Returns the body, its samples and its linear responses.
    """
    mesh = box([0.2, 0.05, 0.05], [4, 2, 2])
    body = nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), SOFT)
    compliance = compute_compliance(body, 0.0)
    able = [c for c in compliance.contacts if mesh.nodes[c, 0] > 0.06]
    contacts = np.random.default_rng(1).choice(able, CONTACTS, replace=False).repeat(2)
    forces = -np.tile([0.02, 0.04], CONTACTS)[:, None] * body.fine.normals[contacts]
    solvers = Equilibrium(body, 0), Equilibrium(body, 1)
    coarse, fine = (
        np.array(
            [
                solver.solve(nodal_load(body, level, c, f, 0.0), 1e-8).x - solver.mesh.nodes
                for c, f in zip(contacts, forces, strict=True)
            ]
        )
        for level, solver in enumerate(solvers)
    )
    return body, database_of(body, contacts, forces, coarse, fine), compliance


def scaled(db: Database, factor: np.ndarray | float) -> Database:
    """Return the database with displacements and forces times ``factor``, a number or (k,)."""
    factor = np.reshape(factor, (-1, 1, 1))
    more = {name: getattr(db, name) * factor for name in ("fine", "coarse_paper", "coarse_live")}
    return replace(db, force=db.force * factor[:, 0], **more)


def methods(db: Database, train: np.ndarray, settings: FitOptions = SETTINGS) -> dict:
    """Fit all METHODS with cross-validation on the samples ``train`` of the live protocol."""
    return build(db, pressed()[2], train, "live", settings)


def blends(db: Database, train: np.ndarray, sigma: float | dict[str, float], settings: FitOptions = SETTINGS) -> dict:
    """Fit the regressors BLENDS with a width of ``sigma`` median distances between features, or in [m] by name."""
    fold = np.zeros(len(train), dtype=int)  # the width is given, so that no fold is needed and one sample is enough
    training = Training(
        db.coarse_live[train], db.fine[train], db.contact[train], db.force[train], db.peaks[train], fold
    )
    found = {}
    for name, features in kinds(db, settings.neighbours).items():
        known = DescribedSamples(features, training, settings)
        for kind in WEIGHTS:
            blend = f"{name}_{kind}"
            width = sigma[blend] if isinstance(sigma, dict) else sigma * known.scale
            found[blend] = Blend(known, kind, width)
    return found
