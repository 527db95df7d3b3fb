"""Correct a coarse simulation by the linear detail that it lacks, with and without what is learnt from samples."""

from dataclasses import replace

import numpy as np

from palpate.enrichment.detail_correction import DetailCorrection
from palpate.enrichment.training_samples import gather
from palpate.models.coarse_enriched import Enriched, sample_counts
from palpate.models.fem import LOOSE, simulated
from palpate.models.fem_statics import LinearCoarse, Simulation
from palpate.models.model import Case, Setting


def settings(case: Case) -> list[Setting]:
    """How the coarse mesh is simulated (so many iterations, or to a tolerance), and how many samples are learnt from.

    None leaves gain and rest out, ``turned`` false the rotations too.
    """
    everything = {"samples": case.n_training}
    briefly = [{"iterations": n} | everything for n in (2, 3)]
    loosely = [{"tolerance": LOOSE, "samples": 0, "turned": False}, {"tolerance": LOOSE, "samples": 0}]
    converged = [{"tolerance": case.tolerance, "samples": count} for count in sample_counts(case)]
    return [*briefly, *loosely, {"tolerance": LOOSE} | everything, *converged]


def prepare(case: Case, setting: Setting) -> Enriched:
    """The detail of every contact, and gain and rest fitted to coarse answers such as queries will get."""
    return corrected(case, setting, Simulation(case, 0, **simulated(case, setting)))


def corrected(case: Case, setting: Setting, coarse: Simulation | LinearCoarse) -> Enriched:
    """``coarse``, corrected with as many training samples as ``setting`` says."""
    method = DetailCorrection(case.meshes, case.compliance, "live", setting.get("turned", True))
    if setting["samples"]:
        db = case.first(setting["samples"]).training
        answers = [coarse.displacement(int(c), f) for c, f in zip(db.contact, db.force, strict=True)]
        seen = replace(db, coarse_live=np.array(answers))
        method.learn(gather(seen, np.arange(len(answers)), "live", case.options), case.options)
    return Enriched(case, method, coarse)
