"""The coarse simulation interpolated linearly: what any user has before learning anything."""

from palpate.enrichment.interpolation import Interpolation
from palpate.models.coarse_enriched import Enriched, coarse_simulation
from palpate.models.model import Case, Setting


def settings(case: Case) -> list[Setting]:
    """There is nothing to turn; fem_coarse is the same with the coarse simulation stopped early."""
    return [{}]


def prepare(case: Case, setting: Setting) -> Enriched:
    """Nothing is learnt; the meshes alone are taken from the samples."""
    return Enriched(case, Interpolation(case.meshes), coarse_simulation(case))
