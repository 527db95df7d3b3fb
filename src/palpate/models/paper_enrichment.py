"""Put paper 1's enrichment, in all its forms, on top of the coarse simulation: a kind of feature, a kind of weights."""

from palpate.enrichment.blend import fit
from palpate.models.coarse_enriched import Enriched, coarse_simulation, fitting_to
from palpate.models.model import Case, Setting, distinct, training_counts


def settings(case: Case, features: str, weights: str) -> list[Setting]:
    """List training samples k, and of paper 1's contact-ordered feature its neighbours l, with all samples."""
    grid, usual = case.grid["paper_enrichment"], {"neighbours": case.options.neighbours}
    found = [{"samples": count} for count in training_counts(case, grid["training_shares"])]
    if features == "unordered":
        return found
    found = [count | usual for count in found]
    if features == "ordered":
        most = len(case.meshes.coarse_surface)
        found += [{"samples": case.n_training, "neighbours": n} for n in grid["neighbours"] if n < most]
    return distinct(found)


def prepare(case: Case, setting: Setting, features: str, weights: str) -> Enriched:
    """Choose σ by cross-validation on the training samples, and order the nodes around all contacts in advance."""
    fitting = fitting_to(case.first(setting["samples"]))
    method = fit(fitting, features, weights, setting.get("neighbours"))
    method.order_ahead(fitting.db.coarse_surface)
    return Enriched(method, coarse_simulation(case))
