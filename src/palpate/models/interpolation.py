"""Interpolate the coarse answer linearly: what any user has before learning anything."""

from palpate.enrichment.interpolation import Interpolation
from palpate.models.coarse_answers import coarse_settings, coarse_solver
from palpate.models.coarse_enriched import Enriched
from palpate.models.model import Case, Setting

SEES, LAW = "deformation", "the body's"


def settings(case: Case) -> list[Setting]:
    """List the coarse answers; simulated ones are those of fem_p1 on level 0."""
    return coarse_settings(case, {})


def prepare(case: Case, setting: Setting) -> Enriched:
    """Take the meshes; nothing is learnt."""
    return Enriched(Interpolation(case.meshes), coarse_solver(case, setting))
