"""Answer with linear fine finite elements, and a kernel ridge on what they lack; nothing is simulated."""

from palpate.benchmark.model import Case, Setting, one_stage
from palpate.models.linear_fem import LinearFem
from palpate.models.warped_compliance import Stored, shares

PREPARED, REDUCES, LAW = True, "p2", "linear"


def settings(case: Case) -> list[Setting]:
    """List how many training samples are learnt from."""
    return shares(case, "linear_residual")


def prepare(case: Case, setting: Setting) -> Stored:
    """Take the compliance, and choose what describes a load, width and ridge by cross-validation."""
    return Stored(case, LinearFem(case.use_compliance()), setting["samples"])


offline = one_stage(prepare)
