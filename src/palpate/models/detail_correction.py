"""Correct a coarse answer by the linear detail that it lacks, turned with the body, and by what samples teach.

The detail is a stored linear response, as in precomputed Green's functions (James and Pai 1999), and is turned node by
node, as in modal warping (Choi and Ko 2005). Unlike there, only what the coarse mesh cannot represent is linear: this
is a two-level correction. ``warped_compliance`` is the method that turns the whole linear response.
"""

import numpy as np

from palpate.benchmark.model import Case, Setting, training_counts
from palpate.models.coarse_answers import coarse_settings, coarse_solver, seen_with
from palpate.models.coarse_enriched import Enriched
from palpate.models.enrichment.detail_correction import DetailCorrection
from palpate.models.enrichment.training_samples import gather

PREPARED, REDUCES, LAW = True, "p2", "the body's"


def settings(case: Case) -> list[Setting]:
    """List the coarse answers, and with the best of them how many samples are learnt from.

    Without samples neither scale nor residual is learnt; with ``turned`` false nothing is turned either.
    """
    counts = training_counts(case, case.grid["detail_correction"]["training_shares"])
    fewer = [{"samples": 0, "turned": False}, {"samples": 0}, *({"samples": count} for count in counts)]
    return coarse_settings(case, {"samples": case.n_training}, fewer)


def prepare(case: Case, setting: Setting) -> Enriched:
    """Compute the detail of every contact, and fit scale and residual to coarse answers such as queries will get."""
    coarse = coarse_solver(case, setting)
    method = DetailCorrection(case.meshes, case.use_compliance(), "live", setting.get("turned", True))
    if setting["samples"]:
        db = seen_with(case, setting, coarse).first(setting["samples"]).use_training()
        method.learn(gather(db, np.arange(len(db.contact)), "live", case.options), case.options)
    return Enriched(method, coarse)
