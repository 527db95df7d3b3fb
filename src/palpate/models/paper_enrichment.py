"""Paper 1's enrichment in all its forms: a kind of feature and a kind of weights, on top of the coarse simulation."""

from palpate.enrichment.blend import Blend, Known
from palpate.enrichment.feature_vectors import kinds
from palpate.models.coarse_enriched import Enriched, coarse_simulation, learnt_from, sample_counts
from palpate.models.model import Case, Setting

NEIGHBOURS = (1, 4, 20, 40)
"""Lengths of the contact-ordered feature that are tried beside the configured one."""


def settings(case: Case, features: str, weights: str) -> list[Setting]:
    """Training samples k; and of paper 1's contact-ordered feature its neighbours l, with all samples."""
    counts = [{"samples": count} for count in sample_counts(case)]
    if features == "unordered":
        return counts
    usual = {"neighbours": case.options.neighbours}
    found = [count | usual for count in counts]
    if features == "ordered":
        most = len(case.meshes.coarse_surface)
        lengths = [n for n in NEIGHBOURS if n < most and n != case.options.neighbours]
        found += [{"samples": case.n_training, "neighbours": n} for n in lengths]
    return found


def prepare(case: Case, setting: Setting, features: str, weights: str) -> Enriched:
    """σ by cross-validation on the training samples; the views of all contacts beforehand."""
    fewer = case.first(setting["samples"])
    db, training = learnt_from(fewer)
    seen = kinds(db, setting.get("neighbours", case.options.neighbours))[features]
    for contact in db.coarse_surface:
        seen.view(int(contact))
    known = Known(seen, training, case.options)
    return Enriched(case, Blend(known, weights, known.choose_sigma(weights)), coarse_simulation(case))
