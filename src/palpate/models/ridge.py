"""Put ridge regression to fine displacements, linear or through a kernel, on top of a coarse answer."""

from palpate.benchmark.model import Case, Setting, training_counts
from palpate.models.coarse_answers import coarse_settings, coarse_solver, fitting_to, seen_with
from palpate.models.coarse_enriched import Enriched
from palpate.models.enrichment.ridge import fit

SEES, REDUCES, LAW = "deformation", "p2", "the body's"


def settings(case: Case, kernel: bool) -> list[Setting]:
    """List the coarse answers with all training samples, and with the best of them how many are used."""
    counts = training_counts(case, case.grid["ridge"]["training_shares"])
    return coarse_settings(case, {"samples": case.n_training}, ({"samples": count} for count in counts))


def prepare(case: Case, setting: Setting, kernel: bool) -> Enriched:
    """Choose widths and ridges by cross-validation on the training samples."""
    coarse = coarse_solver(case, setting)
    seen = seen_with(case, setting, coarse).first(setting["samples"])
    return Enriched(fit(fitting_to(seen), kernel), coarse)
