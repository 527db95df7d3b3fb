"""Answer with stored linear responses of both meshes, whose difference is turned with the body; nothing is simulated.

These are precomputed Green's functions (James and Pai 1999) with a warp by nodal rotations (Choi and Ko 2005), which
here turns only what the fine response has beyond the coarse one. On top, a scale and a kernel ridge are learnt from
training samples, as in ``detail_correction``: the linear coarse response stands in the place of a simulated one.
"""

from palpate.models.coarse_enriched import Enriched
from palpate.models.detail_correction import corrected
from palpate.models.fem_statics import LinearCoarse
from palpate.models.model import Case, Setting, distinct, training_counts


def settings(case: Case) -> list[Setting]:
    """List how many training samples are learnt from; without any, neither scale nor residual is learnt."""
    counts = training_counts(case, case.grid["warped_compliance"]["training_shares"])
    return distinct({"samples": count} for count in counts)


def prepare(case: Case, setting: Setting) -> Enriched:
    """Compute the detail of every contact, and fit scale and residual to linear coarse answers, as queries get them."""
    return corrected(case, setting, LinearCoarse(case))
