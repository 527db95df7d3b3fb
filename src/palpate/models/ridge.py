"""Ridge regression from coarse to fine displacements, linear or through a kernel, on top of the coarse simulation."""

from palpate.enrichment.ridge import KernelRidgeDetail, RidgeUpsampling
from palpate.models.coarse_enriched import Enriched, coarse_simulation, learnt_from, sample_counts
from palpate.models.model import Case, Setting


def settings(case: Case, kernel: bool) -> list[Setting]:
    """How many training samples are used."""
    return [{"samples": count} for count in sample_counts(case)]


def prepare(case: Case, setting: Setting, kernel: bool) -> Enriched:
    """Its settings by cross-validation on the training samples."""
    db, training = learnt_from(case.first(setting["samples"]))
    method = KernelRidgeDetail(db, training, case.options) if kernel else RidgeUpsampling(db, training)
    return Enriched(case, method, coarse_simulation(case))
