"""Simulate the coarse mesh, and correct it by the linear detail that it lacks and by what training samples teach.

The detail is a stored linear response, as in precomputed Green's functions (James and Pai 1999), and is turned node by
node, as in modal warping (Choi and Ko 2005). Unlike there, the large deformation is simulated, and only what the coarse
mesh cannot represent is linear.
"""

from dataclasses import replace

import numpy as np

from palpate.enrichment.detail_correction import DetailCorrection
from palpate.enrichment.training_samples import gather
from palpate.models.coarse_enriched import Enriched
from palpate.models.fem_statics import LinearCoarse, Simulation, solver_options
from palpate.models.model import Case, Setting, distinct, training_counts


def settings(case: Case) -> list[Setting]:
    """List how far the coarse mesh is solved (iterations, or a tolerance), and how many samples are learnt from.

    Without samples neither scale nor residual is learnt; with ``turned`` false nothing is turned either.
    """
    grid, everything = case.grid["detail_correction"], {"samples": case.n_training}
    briefly = [{"iterations": n} | everything for n in grid["iterations"]]
    parts = ({"samples": 0, "turned": False}, {"samples": 0}, everything)
    loosely = [{"tolerance": tolerance} | part for tolerance in grid["tolerances"] for part in parts]
    counts = training_counts(case, grid["training_shares"])
    converged = [{"tolerance": case.tolerance, "samples": count} for count in counts]
    return distinct([*briefly, *loosely, *converged])


def prepare(case: Case, setting: Setting) -> Enriched:
    """Compute the detail of every contact, and fit scale and residual to coarse answers such as queries will get."""
    return corrected(case, setting, Simulation(case, 0, **solver_options(case, setting)))


def corrected(case: Case, setting: Setting, coarse: Simulation | LinearCoarse) -> Enriched:
    """Correct ``coarse``, with as many training samples as ``setting`` says."""
    method = DetailCorrection(case.meshes, case.use_compliance(), "live", setting.get("turned", True))
    if setting["samples"]:
        db = case.first(setting["samples"]).use_training()
        answers = [coarse.displacement(int(c), f) for c, f in zip(db.contact, db.force, strict=True)]
        seen = replace(db, coarse_live=np.array(answers))
        method.learn(gather(seen, np.arange(len(answers)), "live", case.options), case.options)
    return Enriched(method, coarse)
