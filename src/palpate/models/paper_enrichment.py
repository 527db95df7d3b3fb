"""Put paper 1's enrichment, in all its forms, on top of a coarse answer: a kind of feature, a kind of weights."""

from palpate.benchmark.model import Case, Setting, training_counts
from palpate.models.coarse_answers import coarse_settings, coarse_solver, fitting_to, seen_with
from palpate.models.coarse_enriched import Enriched
from palpate.models.enrichment.blend import fit

SEES, REDUCES, LAW = "deformation", "p2", "the body's"


def settings(case: Case, features: str, weights: str) -> list[Setting]:
    """List coarse answers; with the best, training samples k and the neighbours l of the contact-ordered feature."""
    grid = case.grid["paper_enrichment"]
    usual = {} if features == "unordered" else {"neighbours": case.options.neighbours}
    fewer = [{"samples": count} | usual for count in training_counts(case, grid["training_shares"])]
    if features == "ordered":
        most = len(case.meshes.coarse_surface)
        fewer += [{"samples": case.n_training, "neighbours": n} for n in grid["neighbours"] if n < most]
    return coarse_settings(case, {"samples": case.n_training} | usual, fewer)


def prepare(case: Case, setting: Setting, features: str, weights: str) -> Enriched:
    """Choose σ by cross-validation on the training samples, and order the nodes around all contacts in advance."""
    coarse = coarse_solver(case, setting)
    fitting = fitting_to(seen_with(case, setting, coarse).first(setting["samples"]))
    method = fit(fitting, features, weights, setting.get("neighbours"))
    method.order_ahead(fitting.db.coarse_surface)
    return Enriched(method, coarse)
