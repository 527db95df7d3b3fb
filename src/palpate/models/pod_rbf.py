"""Put proper orthogonal decomposition with radial basis functions on top of a coarse answer."""

from palpate.benchmark.model import Case, Setting
from palpate.models.coarse_answers import coarse_settings, coarse_solver, fitting_to, seen_with
from palpate.models.coarse_enriched import Enriched
from palpate.models.enrichment.pod_rbf import fit

SEES, REDUCES, LAW = "deformation", "p2", "the body's"


def settings(case: Case) -> list[Setting]:
    """List the coarse answers with a mode for each sample but the mean, and with the best of them fewer modes."""
    most = case.n_training - 1
    counts = sorted({min(modes, most) for modes in case.grid["pod_rbf"]["modes"]})
    return coarse_settings(case, {"modes": most}, ({"modes": modes} for modes in counts))


def prepare(case: Case, setting: Setting) -> Enriched:
    """Choose kernel and width by cross-validation on the training samples."""
    coarse = coarse_solver(case, setting)
    return Enriched(fit(fitting_to(seen_with(case, setting, coarse)), setting["modes"]), coarse)
