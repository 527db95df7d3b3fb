"""Correct the coarse mesh's stored linear response as detail correction does a simulated one."""

from palpate.models.coarse_enriched import Enriched
from palpate.models.detail_correction import corrected
from palpate.models.fem_statics import LinearCoarse
from palpate.models.model import Case, Setting


def settings(case: Case) -> list[Setting]:
    """With no training samples, which leaves gain and rest out, and with all."""
    return [{"samples": 0}, {"samples": case.n_training}]


def prepare(case: Case, setting: Setting) -> Enriched:
    """The detail of every contact, and gain and rest fitted to linear coarse answers such as queries will get."""
    return corrected(case, setting, LinearCoarse(case))
