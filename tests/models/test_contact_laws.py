"""Contact modes under each law: as near to that law's own elements as under the corotational one, and far from its."""

from dataclasses import replace

import pytest

from palpate.benchmark.load import Load
from palpate.bodies.material import LAWS
from palpate.models import fem
from palpate.models.contact_modes import contact_modes
from tests.models.contact_modes.test_contact_modes import OPERATOR, distance


@pytest.mark.parametrize("law", LAWS[1:])
def test_a_law_is_answered_by_its_own_elements(slab_case, law):
    case, test, _ = slab_case
    body, contact = case.body, int(test.contact[0])
    lawful = replace(case, radius_m=0.03, body=replace(body, material=replace(body.material, law=law)), used={})
    load = Load.at(contact, 0.6 * test.force[0])
    converged = {"level": 1, "start": "rest", "tolerance": 1e-8}
    own, other = (fem.Fem(each, converged, 2).respond(load) for each in (lawful, replace(case, radius_m=0.03)))
    found = contact_modes.offline(lawful).online(OPERATOR).respond(load).displacement
    assert distance(found, own) < min(0.002, 0.25 * distance(found, other))
