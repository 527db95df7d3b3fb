"""Answer with stored linear responses of the fine mesh, turned with the rotations that they have themselves.

These are precomputed Green's functions (James and Pai 1999) with the warp of Choi and Ko (2005). Nothing is simulated,
and with no samples nothing is learnt; otherwise a kernel ridge on what the warp leaves is added.
"""

from palpate.benchmark.model import Case, Setting
from palpate.models.enrichment.warped_response import WarpedResponse
from palpate.models.stored_responses import Stored, shares

PREPARED, REDUCES, LAW = True, "p2", "warped linear"


def settings(case: Case) -> list[Setting]:
    """List how many training samples are learnt from; with none, the method is the published one."""
    return shares(case, "warped_compliance")


def prepare(case: Case, setting: Setting) -> Stored:
    """Find the rotations of every stored response, and fit the residual."""
    return Stored(case, WarpedResponse(case.meshes, case.use_compliance()), setting["samples"])
