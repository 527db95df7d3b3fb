"""Answer with linear responses of fine finite elements, computed in advance: three columns for each contact.

Linear responses superpose; for prescribed disc displacements the forces follow from a 3k × 3k system.
"""

from palpate.benchmark.model import Case
from palpate.models import kinds
from palpate.models.limit import at_limit
from palpate.models.warped_compliance import Stored
from palpate.models.warped_response import LinearFem


def prepare(case: Case, model: kinds.LinearFEM) -> Stored:
    """Take the responses, or their limit; nothing is learnt."""
    case = at_limit(case) if model.target else case
    return Stored(case, LinearFem(case.use_compliance()), 0)
