"""Proper orthogonal decomposition with radial basis functions, on top of the coarse simulation."""

from palpate.enrichment.pod_rbf import PodRbf
from palpate.models.coarse_enriched import Enriched, coarse_simulation, learnt_from
from palpate.models.model import Case, Setting

MODES = (1, 2, 4, 8, 16, 32)


def settings(case: Case) -> list[Setting]:
    """How many modes are kept, up to one a sample but the mean."""
    most = case.n_training - 1
    return [{"modes": modes} for modes in sorted({min(modes, most) for modes in (*MODES, most)})]


def prepare(case: Case, setting: Setting) -> Enriched:
    """Kernel and width by cross-validation on the training samples."""
    db, training = learnt_from(case)
    return Enriched(case, PodRbf(db, training, setting["modes"]), coarse_simulation(case))
