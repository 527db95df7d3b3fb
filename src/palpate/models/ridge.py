"""Put ridge regression to fine displacements, linear or through a kernel, on top of the coarse simulation."""

from palpate.enrichment.ridge import fit
from palpate.models.coarse_enriched import Enriched, coarse_simulation, fitting_to
from palpate.models.model import Case, Setting, training_counts


def settings(case: Case, kernel: bool) -> list[Setting]:
    """List how many training samples are used."""
    return [{"samples": count} for count in training_counts(case, case.grid["ridge"]["training_shares"])]


def prepare(case: Case, setting: Setting, kernel: bool) -> Enriched:
    """Choose widths and ridges by cross-validation on the training samples."""
    return Enriched(fit(fitting_to(case.first(setting["samples"])), kernel), coarse_simulation(case))
