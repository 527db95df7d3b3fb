"""Put proper orthogonal decomposition with radial basis functions on top of the coarse simulation."""

from palpate.enrichment.pod_rbf import fit
from palpate.models.coarse_enriched import Enriched, coarse_simulation, fitting_to
from palpate.models.model import Case, Setting


def settings(case: Case) -> list[Setting]:
    """List how many modes are kept, up to one for each sample but the mean."""
    most = case.n_training - 1
    counts = sorted({min(modes, most) for modes in (*case.grid["pod_rbf"]["modes"], most)})
    return [{"modes": modes} for modes in counts]


def prepare(case: Case, setting: Setting) -> Enriched:
    """Choose kernel and width by cross-validation on the training samples."""
    return Enriched(fit(fitting_to(case), setting["modes"]), coarse_simulation(case))
