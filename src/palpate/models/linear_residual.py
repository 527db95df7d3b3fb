"""Answer with linear fine finite elements, and a kernel ridge on what they lack; nothing is simulated."""

from palpate.benchmark.model import Case
from palpate.models import kinds
from palpate.models.warped_compliance import Stored
from palpate.models.warped_response import LinearFem


def prepare(case: Case, model: kinds.LinearResidual) -> Stored:
    """Take the compliance, and choose what describes a load, width and ridge by cross-validation."""
    return Stored(case, LinearFem(case.use_compliance()), model.samples)
