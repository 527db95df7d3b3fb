"""Interpolate the coarse simulation linearly: what any user has before learning anything."""

from palpate.enrichment.interpolation import Interpolation
from palpate.models.coarse_enriched import Enriched, coarse_simulation
from palpate.models.model import Case, Setting


def settings(case: Case) -> list[Setting]:
    """List the one setting there is; fem_coarse is the same with the coarse simulation stopped early."""
    return [{}]


def prepare(case: Case, setting: Setting) -> Enriched:
    """Take the meshes; nothing is learnt."""
    return Enriched(Interpolation(case.meshes), coarse_simulation(case))
