"""Our method: a coarse answer corrected by the linear detail that it misses, with and without what it learns."""

from dataclasses import replace

import numpy as np

from palpate.enrichment.detail_correction import TwoLevel
from palpate.enrichment.training_samples import gather
from palpate.models.coarse_enriched import Enriched, sample_counts
from palpate.models.fem import LOOSE, simulated
from palpate.models.fem_statics import LinearCoarse, Simulation
from palpate.models.model import Case, Knob


def knobs(case: Case) -> list[Knob]:
    """How the coarse mesh is answered (its stored linear response, or so many iterations, or a tolerance), and how
    many samples are learnt from: none leaves gain and rest out, ``turned`` false the rotations too."""
    everything = {"samples": case.n_training}
    briefly = [{"coarse": "linear", "samples": 0}, {"coarse": "linear"} | everything]
    briefly += [{"iterations": n} | everything for n in (2, 3)]
    loosely = [{"tolerance": LOOSE, "samples": 0, "turned": False}, {"tolerance": LOOSE, "samples": 0}]
    converged = [{"tolerance": case.tolerance, "samples": count} for count in sample_counts(case)]
    return [*briefly, *loosely, {"tolerance": LOOSE} | everything, *converged]


def prepare(case: Case, knob: Knob) -> Enriched:
    """The detail of every contact, and gain and rest fitted to coarse answers such as queries will get."""
    coarse = LinearCoarse(case) if "coarse" in knob else Simulation(case, 0, **simulated(case, knob))
    method = TwoLevel(case.meshes, case.compliance, "live", knob.get("turned", True))
    if knob["samples"]:
        db = case.first(knob["samples"]).training
        answers = [coarse.displacement(int(c), f) for c, f in zip(db.contact, db.force, strict=True)]
        seen = replace(db, coarse_live=np.array(answers))
        method.learn(gather(seen, np.arange(len(answers)), "live", case.settings), case.settings)
    return Enriched(case, method, coarse)
